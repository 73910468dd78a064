// SPDX-License-Identifier: MIT
// Layouts of the messages of admin_rules.h; each pair of functions follows the comment at its struct.
#include "proto/admin_rules.h"

#include "proto/body.h"

namespace pmcd::proto {

namespace {

constexpr std::uint8_t kDryRun = 1;
constexpr std::uint8_t kIfVersion = 2;
constexpr std::size_t kTermsAt = 4;  ///< behind the id

void write_terms(ByteWriter& writer, const ChangeTerms& terms) {
  writer.u8(static_cast<std::uint8_t>((terms.dry_run ? kDryRun : 0) | (terms.if_version ? kIfVersion : 0)));
  writer.u64(terms.if_version.value_or(0));
}

/// A reader that failed is left for finish() to judge.
Result<ChangeTerms> read_terms(ByteReader& reader) {
  const std::uint8_t flags = reader.u8();
  const std::uint64_t version = reader.u64();
  ChangeTerms terms;
  if (reader.failed()) return terms;
  if ((flags & ~(kDryRun | kIfVersion)) != 0) return malformed(kTermsAt, "unknown flags of a change");
  terms.dry_run = (flags & kDryRun) != 0;
  if ((flags & kIfVersion) != 0) {
    terms.if_version = version;
  } else if (version != 0) {
    return malformed(kTermsAt + 1, "a version without the flag that it is given");
  }
  return terms;
}

}  // namespace

Bytes encode(const AdminRules& message) {
  return encode_id_only(message);
}
Bytes encode(const AdminRule& message) {
  return encode_id_only(message);
}
Bytes encode(const AdminQueue& message) {
  return encode_id_only(message);
}
Bytes encode(const AdminClients& message) {
  return encode_id_only(message);
}

template <>
Result<AdminRules> decode<AdminRules>(ByteView body) {
  return decode_id_only<AdminRules>(body, false);
}

template <>
Result<AdminRule> decode<AdminRule>(ByteView body) {
  return decode_id_only<AdminRule>(body, false);
}

template <>
Result<AdminQueue> decode<AdminQueue>(ByteView body) {
  return decode_id_only<AdminQueue>(body, false);
}

template <>
Result<AdminClients> decode<AdminClients>(ByteView body) {
  return decode_id_only<AdminClients>(body, false);
}

Bytes encode(const AdminSetRule& message) {
  ByteWriter writer;
  writer.u32(message.id);
  write_terms(writer, message.terms);
  writer.str8(message.rule);
  writer.u8(static_cast<std::uint8_t>(message.options.size()));
  for (const RuleOptionText& option : message.options) {
    writer.str8(option.name);
    writer.str8(option.value);
  }
  return make_frame(AdminSetRule::kType, writer.take());
}

template <>
Result<AdminSetRule> decode<AdminSetRule>(ByteView body) {
  ByteReader reader(body);
  AdminSetRule message;
  message.id = reader.u32();
  const auto terms = read_terms(reader);
  if (!terms) return terms.error();
  message.terms = *terms;
  message.rule = reader.str8();
  const std::size_t count_at = reader.position();
  const std::size_t count = reader.u8();
  if (count > kMaxRuleOptions) return malformed(count_at, "a rule with too many options");
  for (std::size_t i = 0; i < count && !reader.failed(); ++i) {
    RuleOptionText option;
    option.name = reader.str8();
    option.value = reader.str8();
    message.options.push_back(std::move(option));
  }
  return finish_request(reader, std::move(message));
}

Bytes encode(const AdminHistory& message) {
  ByteWriter writer;
  writer.u32(message.id);
  writer.u32(message.most);
  return make_frame(AdminHistory::kType, writer.take());
}

template <>
Result<AdminHistory> decode<AdminHistory>(ByteView body) {
  ByteReader reader(body);
  AdminHistory message;
  message.id = reader.u32();
  message.most = reader.u32();
  return finish_request(reader, message);
}

Bytes encode(const AdminRevert& message) {
  ByteWriter writer;
  writer.u32(message.id);
  write_terms(writer, message.terms);
  writer.u64(message.change);
  return make_frame(AdminRevert::kType, writer.take());
}

template <>
Result<AdminRevert> decode<AdminRevert>(ByteView body) {
  ByteReader reader(body);
  AdminRevert message;
  message.id = reader.u32();
  const auto terms = read_terms(reader);
  if (!terms) return terms.error();
  message.terms = *terms;
  message.change = reader.u64();
  return finish_request(reader, message);
}

Bytes encode(const AdminExplain& message) {
  ByteWriter writer;
  writer.u32(message.id);
  writer.u64(message.session);
  return make_frame(AdminExplain::kType, writer.take());
}

template <>
Result<AdminExplain> decode<AdminExplain>(ByteView body) {
  ByteReader reader(body);
  AdminExplain message;
  message.id = reader.u32();
  message.session = reader.u64();
  return finish_request(reader, message);
}

Bytes encode(const AdminWeight& message) {
  ByteWriter writer;
  writer.u32(message.id);
  writer.u64(message.session);
  writer.u32(message.weight);
  return make_frame(AdminWeight::kType, writer.take());
}

template <>
Result<AdminWeight> decode<AdminWeight>(ByteView body) {
  ByteReader reader(body);
  AdminWeight message;
  message.id = reader.u32();
  message.session = reader.u64();
  message.weight = reader.u32();
  if (!reader.failed() && (message.weight == 0 || message.weight > kMaxWeight)) {
    return malformed(12, "a weight is not between 0.001 and 1000000");
  }
  return finish_request(reader, message);
}

}  // namespace pmcd::proto
