// SPDX-License-Identifier: MIT
// Every message of every channel: u16 type, then a body. What decode accepts must come back from encode and decode as
// the same message, as the same bytes where only one form exists; its texts can be printed and its numbers lie in their
// ranges. Type 0xffff stands for a page of the mesh list, 0xfffe for a text, 0xfffd for a code.
#include <algorithm>
#include <string>

#include "proto/admin.h"
#include "proto/admin_rules.h"
#include "proto/mesh_list.h"
#include "proto/messages.h"
#include "proto/session.h"
#include "proto/text.h"
#include "tests/fuzz/check.h"
#include "tests/fuzz/script.h"

namespace pmcd::fuzz {
namespace {

using proto::Bytes;
using proto::ByteView;
using proto::FrameType;

constexpr std::uint16_t kMeshPage = 0xffff;
constexpr std::uint16_t kText = 0xfffe;
constexpr std::uint16_t kCode = 0xfffd;

bool same(ByteView a, ByteView b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end());
}

/// The body of a frame that was just encoded; checks its header.
Bytes body_of(const Bytes& frame, FrameType type, std::uint32_t limit) {
  proto::FrameReader reader(limit);
  ByteView input(frame);
  const auto next = reader.next(input);
  check(next.ok() && next.value().has_value() && input.empty(), "an encoded message is not one frame");
  check((*next)->type == static_cast<std::uint16_t>(type), "an encoded message has another type");
  return {(*next)->body.begin(), (*next)->body.end()};
}

template <typename M>
bool may_have_grown(const M& message) {
  if constexpr (requires { message.version; }) return message.version.minor > proto::kVersionMinor;
  return false;
}

template <typename M>
void judge(const M& message) {
  if constexpr (requires { message.agent; }) {
    check(message.agent.size() <= proto::kMaxAgentBytes && proto::is_printable_utf8(message.agent),
          "an agent's name that cannot be printed");
  }
  if constexpr (std::is_same_v<M, proto::ErrorMessage> || std::is_same_v<M, proto::Notice>) {
    check(message.text.size() <= proto::kMaxErrorTextBytes && proto::is_printable_utf8(message.text),
          "a text that cannot be printed");
  }
}

template <typename M>
void message(ByteView body, std::uint32_t limit) {
  if (body.size() + proto::kTypeBytes > limit) return;
  const auto first = proto::decode<M>(body);
  if (!first) {
    check(!first.error().detail.empty(), "an error without a word");
    check(proto::find_code(static_cast<std::uint16_t>(first.error().code)) != nullptr, "an error without a code");
    return;
  }
  judge(*first);
  const Bytes again = body_of(proto::encode(*first), M::kType, limit);
  const auto second = proto::decode<M>(again);
  check(second.ok() && *second == *first, "a message changes on its way");
  check(may_have_grown(*first) ? again.size() <= body.size() : same(again, body), "a message has two forms");
}

void chunk(ByteView body) {
  const auto decoded = proto::decode_chunk(body);
  if (!decoded) return;
  const auto size = static_cast<std::uint32_t>(decoded->bytes.size());
  check(size > 0 && decoded->header.id != 0, "an empty chunk, or one of no request");
  check(decoded->header.offset <= decoded->header.total && size <= decoded->header.total - decoded->header.offset,
        "a chunk beyond its total");
  const auto head = proto::encode_chunk_header(decoded->header, size);
  Bytes frame(head.begin(), head.end());
  frame.insert(frame.end(), decoded->bytes.begin(), decoded->bytes.end());
  check(same(body_of(frame, FrameType::chunk, proto::kMaxDataFrame), body), "a chunk has two forms");
}

void ingest_data(ByteView body) {
  const auto decoded = proto::decode_ingest_data(body);
  if (!decoded) return;
  const auto size = static_cast<std::uint32_t>(decoded->bytes.size());
  check(size > 0 && decoded->header.id != 0, "empty ingest_data, or of no request");
  const auto head = proto::encode_ingest_data_header(decoded->header, size);
  Bytes frame(head.begin(), head.end());
  frame.insert(frame.end(), decoded->bytes.begin(), decoded->bytes.end());
  check(same(body_of(frame, FrameType::ingest_data, proto::kMaxAdminFrame), body), "ingest_data has two forms");
}

void mesh_page(ByteView bytes) {
  const auto page = proto::decode_mesh_page(bytes);
  if (!page) return;
  check(page->entries.size() <= proto::kMaxPageEntries, "a page with too many meshes");
  check(std::uint64_t{page->remaining} + page->entries.size() <= page->matches, "a page with too few matches");
  for (const proto::MeshListEntry& entry : page->entries) {
    check(proto::is_mesh_name(entry.name), "a page with a name that is none");
    check(proto::matches_filter(entry.name, entry.name) && proto::matches_filter(entry.name, ""),
          "a name that does not match itself");
  }
  check(same(proto::encode_mesh_page(*page), bytes), "a page has two forms");
}

void any_text(ByteView bytes) {
  const std::string_view raw(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  const std::string cleaned = proto::printable(raw, proto::kMaxErrorTextBytes);
  check(cleaned.size() <= proto::kMaxErrorTextBytes && proto::is_printable_utf8(cleaned), "printable() is not");
  check(proto::printable(cleaned, proto::kMaxErrorTextBytes) == cleaned, "printable() twice is not printable() once");
  if (raw.size() <= proto::kMaxErrorTextBytes && proto::is_printable_utf8(raw)) {
    check(cleaned == raw, "printable() changes what can be printed");
  }
  if (proto::is_mesh_name(raw)) check(proto::is_printable_utf8(raw), "a mesh name that cannot be printed");
  proto::ErrorMessage error;
  error.text = raw;
  check(
      proto::decode<proto::ErrorMessage>(body_of(proto::encode(error), FrameType::error, proto::kMaxAnswerFrame)).ok(),
      "an error with any text cannot be read");
  Bytes answer;
  const auto pieces = proto::encode_answer(1, raw);
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    const auto piece =
        proto::decode<proto::AdminAnswer>(body_of(pieces[i], FrameType::admin_answer, proto::kMaxAdminFrame));
    check(piece.ok() && piece->last == (i + 1 == pieces.size()), "an answer in pieces does not say which is the last");
    const ByteView part = proto::as_bytes(piece->text);
    answer.insert(answer.end(), part.begin(), part.end());
  }
  check(same(answer, bytes), "an answer in pieces is another");
}

void code(ByteView bytes) {
  proto::ByteReader reader(bytes);
  const std::uint16_t number = reader.u16();
  const auto error = static_cast<proto::ErrorCode>(number);
  const proto::CodeInfo* info = proto::find_code(number);
  check(info == nullptr || (info->ends == proto::code_ends(error) && info->name == proto::code_name(error)),
        "a code that is two");
  check(proto::is_printable_utf8(proto::code_name(error)), "the name of a code cannot be printed");
  for (const auto channel : {proto::Channel::request, proto::Channel::data, proto::Channel::admin}) {
    for (const auto state : {proto::SessionState::fresh, proto::SessionState::greeted, proto::SessionState::joined}) {
      const auto judged = proto::check_client_frame(channel, state, number);
      check(judged == proto::ErrorCode::none || proto::find_code(static_cast<std::uint16_t>(judged)) != nullptr,
            "a frame is judged by no code");
    }
  }
}

}  // namespace

void messages(Input input) {
  Script script(input);
  const std::uint16_t type = script.u16();
  // A copy of its own length, so that the address sanitizer sees a read past its end.
  const Input rest = script.rest();
  const Bytes body(rest.begin(), rest.end());
  if (type == kMeshPage) return mesh_page(body);
  if (type == kText) return any_text(body);
  if (type == kCode) return code(body);
  switch (static_cast<FrameType>(type)) {
    case FrameType::hello:
      return message<proto::Hello>(body, proto::kMaxClientFrame);
    case FrameType::hello_ok:
      return message<proto::HelloOk>(body, proto::kMaxAnswerFrame);
    case FrameType::error:
      return message<proto::ErrorMessage>(body, proto::kMaxAnswerFrame);
    case FrameType::ping:
      return message<proto::Ping>(body, proto::kMaxClientFrame);
    case FrameType::pong:
      return message<proto::Pong>(body, proto::kMaxAnswerFrame);
    case FrameType::goodbye:
      return message<proto::Goodbye>(body, proto::kMaxClientFrame);
    case FrameType::join:
      return message<proto::Join>(body, proto::kMaxClientFrame);
    case FrameType::join_ok:
      return message<proto::JoinOk>(body, proto::kMaxDataFrame);
    case FrameType::notice:
      return message<proto::Notice>(body, proto::kMaxAnswerFrame);
    case FrameType::get_mesh_list:
      return message<proto::GetMeshList>(body, proto::kMaxClientFrame);
    case FrameType::get_base_mesh:
      return message<proto::GetBaseMesh>(body, proto::kMaxClientFrame);
    case FrameType::get_next_packet:
      return message<proto::GetNextPacket>(body, proto::kMaxClientFrame);
    case FrameType::get_packet:
      return message<proto::GetPacket>(body, proto::kMaxClientFrame);
    case FrameType::cancel:
      return message<proto::Cancel>(body, proto::kMaxClientFrame);
    case FrameType::mesh_opened:
      return message<proto::MeshOpened>(body, proto::kMaxAnswerFrame);
    case FrameType::chunk:
      return chunk(body);
    case FrameType::transfer_end:
      return message<proto::TransferEnd>(body, proto::kMaxDataFrame);
    case FrameType::admin_hello:
      return message<proto::AdminHello>(body, proto::kMaxAdminFrame);
    case FrameType::admin_hello_ok:
      return message<proto::AdminHelloOk>(body, proto::kMaxAdminFrame);
    case FrameType::admin_list:
      return message<proto::AdminList>(body, proto::kMaxAdminFrame);
    case FrameType::admin_show:
      return message<proto::AdminShow>(body, proto::kMaxAdminFrame);
    case FrameType::admin_remove:
      return message<proto::AdminRemove>(body, proto::kMaxAdminFrame);
    case FrameType::admin_status:
      return message<proto::AdminStatus>(body, proto::kMaxAdminFrame);
    case FrameType::ingest_begin:
      return message<proto::IngestBegin>(body, proto::kMaxAdminFrame);
    case FrameType::ingest_ready:
      return message<proto::IngestReady>(body, proto::kMaxAdminFrame);
    case FrameType::ingest_data:
      return ingest_data(body);
    case FrameType::ingest_commit:
      return message<proto::IngestCommit>(body, proto::kMaxAdminFrame);
    case FrameType::ingest_ok:
      return message<proto::IngestOk>(body, proto::kMaxAdminFrame);
    case FrameType::admin_answer:
      return message<proto::AdminAnswer>(body, proto::kMaxAdminFrame);
    case FrameType::admin_rules:
      return message<proto::AdminRules>(body, proto::kMaxAdminFrame);
    case FrameType::admin_rule:
      return message<proto::AdminRule>(body, proto::kMaxAdminFrame);
    case FrameType::admin_set_rule:
      return message<proto::AdminSetRule>(body, proto::kMaxAdminFrame);
    case FrameType::admin_history:
      return message<proto::AdminHistory>(body, proto::kMaxAdminFrame);
    case FrameType::admin_revert:
      return message<proto::AdminRevert>(body, proto::kMaxAdminFrame);
    case FrameType::admin_queue:
      return message<proto::AdminQueue>(body, proto::kMaxAdminFrame);
    case FrameType::admin_clients:
      return message<proto::AdminClients>(body, proto::kMaxAdminFrame);
    case FrameType::admin_explain:
      return message<proto::AdminExplain>(body, proto::kMaxAdminFrame);
    case FrameType::admin_weight:
      return message<proto::AdminWeight>(body, proto::kMaxAdminFrame);
  }
  check(proto::type_name(type) == nullptr, "a type with a name that is not fuzzed");
}

}  // namespace pmcd::fuzz
