// SPDX-License-Identifier: MIT
// The table of rules. It holds no state: each call makes a fresh rule.
#include "daemon/scheduler/registry.h"

#include <algorithm>
#include <array>
#include <charconv>

#include "daemon/scheduler/rules/fair.h"
#include "daemon/scheduler/rules/fcsf.h"
#include "daemon/scheduler/rules/fifo.h"
#include "daemon/scheduler/rules/fsp.h"
#include "daemon/scheduler/rules/gain.h"
#include "daemon/scheduler/rules/lcfs.h"
#include "daemon/scheduler/rules/spf.h"
#include "daemon/scheduler/rules/srpt.h"

namespace pmcd::scheduler {
namespace {

constexpr std::array<std::string_view, 2> kBursts = {"1", "2"};
constexpr std::array<std::string_view, 2> kScopes = {"mesh", "packet"};
constexpr std::array kFcsfOptions = {
    RuleOption{"burst", kBursts, "packets in a row that a fast client may get when its next request already waits"}};
constexpr std::array<std::string_view, 4> kPercents = {"0", "1", "5", "10"};
constexpr std::array kGainOptions = {
    RuleOption{"until", kPercents, "percent of its first error from which on a mesh only waits for its end; 0: never"}};
constexpr std::array kSrptOptions = {RuleOption{"scope", kScopes, "what has to be nearest to its end"}};

unsigned percent(const std::string& word) {
  unsigned value = 0;
  std::from_chars(word.data(), word.data() + word.size(), value);
  return value;
}

using Options = const RuleOptions&;
using Around = const Surroundings&;

constexpr std::array kRules = {
    RuleEntry{"fifo",
              "first in, first out: the request that has waited longest",
              {},
              [](Options, Around) { return make_fifo(); }},
    RuleEntry{"lcfs",
              "least completed first served: the client that has received the fewest bytes",
              {},
              [](Options, Around) { return make_lcfs(); }},
    RuleEntry{"spf", "smallest packet first, whoever asks for it", {}, [](Options, Around) { return make_spf(); }},
    RuleEntry{
        "fcsf", "fastest connection first: the packet that is expected to be through soonest", kFcsfOptions,
        [](Options options, Around around) { return make_fcsf(options.find("burst")->second == "2" ? 2 : 1, around); }},
    RuleEntry{"srpt", "shortest remaining time: the client that can have the rest of its mesh soonest", kSrptOptions,
              [](Options options, Around around) {
                return make_srpt(options.find("scope")->second == "packet" ? SrptScope::packet : SrptScope::mesh,
                                 around);
              }},
    RuleEntry{"fsp",
              "one after the other, in the order in which equal sharing would finish them",
              {},
              [](Options, Around around) { return make_fsp(around); }},
    RuleEntry{"gain", "the packet that takes away most visible error for its bytes; first packets first", kGainOptions,
              [](Options options, Around around) { return make_gain(percent(options.find("until")->second), around); }},
    RuleEntry{"fair",
              "equal bytes for all clients in turn, or by the weights that the operator gives",
              {},
              [](Options, Around) { return make_fair(); },
              true},
};

}  // namespace

std::span<const RuleEntry> all_rules() {
  return kRules;
}

const RuleEntry* find_rule(std::string_view name) {
  const auto* const it =
      std::find_if(kRules.begin(), kRules.end(), [name](const RuleEntry& entry) { return entry.name == name; });
  return it == kRules.end() ? nullptr : it;
}

RuleOptions all_options(std::string_view rule, const RuleOptions& given) {
  RuleOptions options = given;
  for (const RuleOption& option : find_rule(rule)->options) {
    options.try_emplace(std::string(option.name), option.words.front());
  }
  return options;
}

std::unique_ptr<Rule> make_rule(std::string_view name, const RuleOptions& given, const Surroundings& surroundings) {
  return find_rule(name)->make(all_options(name, given), surroundings);
}

}  // namespace pmcd::scheduler
