// SPDX-License-Identifier: MIT
// The messages of the admin channel about who is served next: the distribution rule, its changes, the queue and the
// clients. All are requests of the operator's tool and end by admin_answer or error(id), like those of admin.h. Names
// of rules, names and values of options travel as they are: whether they mean anything is for the daemon to judge.
//
// A client is named by its session's number, which stands in the log and in `clients`.
//
// JSON of the answers (fields may be added, readers ignore what they do not know). The policy, R:
//   {"rule","text" ("fcsf burst=2 aging=0 quantum=500 slots=1 uplink=0"),"options":{name:value,... all in force},
//    "version" (number of the last live change, 0: none),"since" (RFC 3339),"by":{"uid","pid"}|null (configuration),
//    "sources":{"rule" and each common option by name: "command line"|"live change"|"config file"|"default"},
//    "uplink_kbit" (present value)|null,"uplink_measured" (bool)}
// rules:    {"rules":[{"name","summary","options":[{"name","values":["1","2"],"default","summary"}]}],
//            "common_options":[{"name","value" (what it takes, for people),"default","summary"}]}
// rule:     R
// set_rule and revert: {"changed" (false for a dry run, or when nothing would differ),
//            "would_change" (the same, but of a dry run as if it were none),"dry_run","seconds" (from the command to
//            the new policy in force, 0: nothing changed),"warnings":[text...],"before":R,"after":R}
// history:  {"changes":[{"number","changed_at","rule"|null (back to the configuration),"options" ("name=value ..."),
//            "uid","pid","reverts"|null}],"damaged":[{"number","error"}]} both newest first; damaged: changes that
//            the database cannot give any more.
// queue:    {"rule","text","waiting","running" (counts),"requests":[request...],"more"}: running first, then waiting in
//            the order in which they would go; at most 1000 requests, `more` is the count of those left out. A request:
//            {"rank" (1: next, 0: running),"state":"running"|"waiting"|"blocked","client","address","mesh","packet",
//             "bytes_left","bytes","asked_seconds_ago","queued_seconds_ago","reason"}
// clients:  {"uplink_kbit"|null,"clients":[{"client","address","speed_kbit"|null,"taking_kbit","weight",
//            "bytes" (acknowledged payload),"share" (0 to 1, of the bytes acknowledged by all connected clients),
//            "mesh"|null,"level" (packets complete of it)|null,"levels"|null,"waiting","running",
//            "connected_seconds"}]}
// explain:  {"client","address","rule","text","next" (bool: this client is next or running),"summary" (a sentence of
//            which the client is the subject: "is next with packet 3 of ..."),"waiting","running","requests":
//            [request...],"more"}: as queue, and this client's own wherever they stand, marked "mine":true.
// weight:   {"client","weight","before","rule","counts" (bool: this rule goes by weights)}
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "proto/messages.h"

namespace pmcd::proto {

inline constexpr std::size_t kMaxRuleOptions = 64;          ///< options in a set_rule
inline constexpr std::uint32_t kMaxWeight = 1'000'000'000;  ///< thousandths
inline constexpr std::uint32_t kWeightOne = 1'000;          ///< the weight of a client that was given none

/// u32 id.
struct AdminRules {
  static constexpr FrameType kType = FrameType::admin_rules;
  std::uint32_t id = 0;
  bool operator==(const AdminRules&) const = default;
};

/// u32 id.
struct AdminRule {
  static constexpr FrameType kType = FrameType::admin_rule;
  std::uint32_t id = 0;
  bool operator==(const AdminRule&) const = default;
};

/// How a change is to be made; in the frame: u8 flags (bit 0: dry run, bit 1: a version is given), u64 version (0 when
/// none is given).
struct ChangeTerms {
  bool dry_run = false;                     ///< say what would be, change nothing
  std::optional<std::uint64_t> if_version;  ///< only while this is the policy's version, else version_changed
  bool operator==(const ChangeTerms&) const = default;
};

struct RuleOptionText {
  std::string name;
  std::string value;
  bool operator==(const RuleOptionText&) const = default;
};

/// u32 id, u8 flags, u64 version, str8 rule, u8 count (at most kMaxRuleOptions), count x (str8 name, str8 value).
struct AdminSetRule {
  static constexpr FrameType kType = FrameType::admin_set_rule;
  std::uint32_t id = 0;
  ChangeTerms terms;
  std::string rule;
  std::vector<RuleOptionText> options;  ///< in the order given; a name may come twice
  bool operator==(const AdminSetRule&) const = default;
};

/// u32 id, u32 most (0: all that are kept).
struct AdminHistory {
  static constexpr FrameType kType = FrameType::admin_history;
  std::uint32_t id = 0;
  std::uint32_t most = 0;
  bool operator==(const AdminHistory&) const = default;
};

/// u32 id, u8 flags, u64 version, u64 change (its number in the history; 0: back to what the configuration says).
struct AdminRevert {
  static constexpr FrameType kType = FrameType::admin_revert;
  std::uint32_t id = 0;
  ChangeTerms terms;
  std::uint64_t change = 0;
  bool operator==(const AdminRevert&) const = default;
};

/// u32 id.
struct AdminQueue {
  static constexpr FrameType kType = FrameType::admin_queue;
  std::uint32_t id = 0;
  bool operator==(const AdminQueue&) const = default;
};

/// u32 id.
struct AdminClients {
  static constexpr FrameType kType = FrameType::admin_clients;
  std::uint32_t id = 0;
  bool operator==(const AdminClients&) const = default;
};

/// u32 id, u64 session.
struct AdminExplain {
  static constexpr FrameType kType = FrameType::admin_explain;
  std::uint32_t id = 0;
  std::uint64_t session = 0;
  bool operator==(const AdminExplain&) const = default;
};

/// u32 id, u64 session, u32 weight in thousandths, 1 to kMaxWeight.
struct AdminWeight {
  static constexpr FrameType kType = FrameType::admin_weight;
  std::uint32_t id = 0;
  std::uint64_t session = 0;
  std::uint32_t weight = kWeightOne;
  bool operator==(const AdminWeight&) const = default;
};

Bytes encode(const AdminRules& message);
Bytes encode(const AdminRule& message);
/// REQUIRES: at most kMaxRuleOptions options, no text of more than 255 bytes.
Bytes encode(const AdminSetRule& message);
Bytes encode(const AdminHistory& message);
Bytes encode(const AdminRevert& message);
Bytes encode(const AdminQueue& message);
Bytes encode(const AdminClients& message);
Bytes encode(const AdminExplain& message);
Bytes encode(const AdminWeight& message);

template <>
Result<AdminRules> decode<AdminRules>(ByteView body);
template <>
Result<AdminRule> decode<AdminRule>(ByteView body);
template <>
Result<AdminSetRule> decode<AdminSetRule>(ByteView body);
template <>
Result<AdminHistory> decode<AdminHistory>(ByteView body);
template <>
Result<AdminRevert> decode<AdminRevert>(ByteView body);
template <>
Result<AdminQueue> decode<AdminQueue>(ByteView body);
template <>
Result<AdminClients> decode<AdminClients>(ByteView body);
template <>
Result<AdminExplain> decode<AdminExplain>(ByteView body);
template <>
Result<AdminWeight> decode<AdminWeight>(ByteView body);

}  // namespace pmcd::proto
