// SPDX-License-Identifier: MIT
// the messages about rule, queue and clients refuse what has their form but not their meaning, and carry any names
// and values unjudged. What every message must do (golden bytes, prefixes, garbage) is in messages_test.cpp.
#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <string>

#include "proto/admin_rules.h"
#include "proto/session.h"
#include "tests/proto/samples.h"

namespace pmcd::proto {
namespace {

using testing::body_of;
using testing::from_hex;

/// Where decoding stopped, with malformed; or a sentence about what happened instead.
template <typename M>
std::string refusal(const Bytes& body) {
  const auto decoded = decode<M>(body);
  if (decoded.ok()) return "accepted";
  if (decoded.error().code != ErrorCode::malformed) return "another code";
  return "at " + std::to_string(decoded.error().where) + ": " + decoded.error().detail;
}

template <typename M>
std::string refusal(const M& message) {
  const Bytes frame = encode(message);
  return refusal<M>(Bytes(body_of(frame).begin(), body_of(frame).end()));
}

TEST(AdminRules, ARequestHasAnId) {
  const std::string no_id = "at 0: the id of a request is 0";
  EXPECT_EQ(refusal(AdminRules{}), no_id);
  EXPECT_EQ(refusal(AdminRule{}), no_id);
  EXPECT_EQ(refusal(AdminSetRule{0, {}, "fifo", {}}), no_id);
  EXPECT_EQ(refusal(AdminHistory{}), no_id);
  EXPECT_EQ(refusal(AdminRevert{}), no_id);
  EXPECT_EQ(refusal(AdminQueue{}), no_id);
  EXPECT_EQ(refusal(AdminClients{}), no_id);
  EXPECT_EQ(refusal(AdminExplain{}), no_id);
  EXPECT_EQ(refusal(AdminWeight{}), no_id);
}

TEST(AdminRules, FlagsAndVersionOfAChangeFitEachOther) {
  const auto set_rule = [](const std::string& terms) {
    return refusal<AdminSetRule>(from_hex("01000000 " + terms + " 01 61 00"));
  };
  const auto revert = [](const std::string& terms) {
    return refusal<AdminRevert>(from_hex("01000000 " + terms + " 0000000000000000"));
  };
  EXPECT_EQ(set_rule("04 0000000000000000"), "at 4: unknown flags of a change");
  EXPECT_EQ(set_rule("83 0000000000000000"), "at 4: unknown flags of a change");
  EXPECT_EQ(set_rule("01 0000000000000001"), "at 5: a version without the flag that it is given");
  EXPECT_EQ(set_rule("02 0000000000000001"), "accepted");
  EXPECT_EQ(revert("04 0000000000000000"), "at 4: unknown flags of a change");
  EXPECT_EQ(revert("00 0100000000000000"), "at 5: a version without the flag that it is given");
  EXPECT_EQ(revert("02 0000000000000000"), "accepted") << "version 0 is a version: nobody has changed the rule";
}

TEST(AdminRules, AtMost64Options) {
  AdminSetRule message{1, {}, "fifo", std::vector<RuleOptionText>(kMaxRuleOptions)};
  EXPECT_EQ(refusal(message), "accepted");
  message.options.emplace_back();
  EXPECT_EQ(refusal(message), "at 18: a rule with too many options");
}

TEST(AdminRules, AWeightIsBetweenAThousandthAndAMillion) {
  const std::string outside = "at 12: a weight is not between 0.001 and 1000000";
  EXPECT_EQ(refusal(AdminWeight{1, 5, 0}), outside);
  EXPECT_EQ(refusal(AdminWeight{1, 5, 1}), "accepted");
  EXPECT_EQ(refusal(AdminWeight{1, 5, 1'000'000'000}), "accepted");
  EXPECT_EQ(refusal(AdminWeight{1, 5, 1'000'000'001}), outside);
}

TEST(AdminRules, FieldsComeThrough) {
  EXPECT_TRUE(rc::check("any texts, versions and numbers", [] {
    const auto text = [] {
      const auto begin = *rc::gen::string<std::string>();
      return (begin + std::string(*rc::gen::inRange<std::size_t>(0, 300), 'x')).substr(0, 255);
    };
    const auto id = *rc::gen::inRange<std::uint32_t>(1, 0xffffffff);
    ChangeTerms terms{*rc::gen::arbitrary<bool>(), std::nullopt};
    if (*rc::gen::arbitrary<bool>()) terms.if_version = *rc::gen::arbitrary<std::uint64_t>();
    AdminSetRule set_rule{id, terms, text(), {}};
    const auto count = *rc::gen::inRange<std::size_t>(0, kMaxRuleOptions + 1);
    for (std::size_t i = 0; i < count; ++i) set_rule.options.push_back({text(), text()});
    RC_ASSERT(decode<AdminSetRule>(body_of(encode(set_rule))).value() == set_rule);
    const AdminRevert revert{id, terms, *rc::gen::arbitrary<std::uint64_t>()};
    RC_ASSERT(decode<AdminRevert>(body_of(encode(revert))).value() == revert);
    const AdminHistory history{id, *rc::gen::arbitrary<std::uint32_t>()};
    RC_ASSERT(decode<AdminHistory>(body_of(encode(history))).value() == history);
    const AdminExplain explain{id, *rc::gen::arbitrary<std::uint64_t>()};
    RC_ASSERT(decode<AdminExplain>(body_of(encode(explain))).value() == explain);
    const AdminWeight weight{id, *rc::gen::arbitrary<std::uint64_t>(), *rc::gen::inRange(1u, kMaxWeight + 1)};
    RC_ASSERT(decode<AdminWeight>(body_of(encode(weight))).value() == weight);
  }));
}

TEST(AdminRules, OnlyTheAdminChannelTakesThem) {
  for (std::uint16_t type = 0x0140; type <= 0x0148; ++type) {
    EXPECT_EQ(check_client_frame(Channel::admin, SessionState::joined, type), ErrorCode::none) << type;
    EXPECT_EQ(check_client_frame(Channel::admin, SessionState::fresh, type), ErrorCode::wrong_state) << type;
    EXPECT_EQ(check_client_frame(Channel::request, SessionState::joined, type), ErrorCode::wrong_state) << type;
    EXPECT_EQ(check_client_frame(Channel::data, SessionState::joined, type), ErrorCode::wrong_state) << type;
  }
  EXPECT_EQ(check_client_frame(Channel::admin, SessionState::joined, 0x0149), ErrorCode::unknown_type);
}

}  // namespace
}  // namespace pmcd::proto
