// SPDX-License-Identifier: MIT
// A distribution policy: a rule with its options, and what is common to all rules. How it is written as names and
// values, how several writings (command line, live change, config file) come together, and what is wrong with one. It
// applies nothing.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "daemon/scheduler/registry.h"
#include "daemon/scheduler/request.h"

namespace pmcd::scheduler {

inline constexpr std::size_t kMaxSlots = 1'024;

/// Plain first in, first out, one transfer at a time; the daemon's default is default_policy().
struct Policy {
  std::string rule = "fifo";
  RuleOptions rule_options;              ///< of that rule
  std::optional<Time> quantum;           ///< a turn that is longer is interrupted when others wait
  std::optional<Time> aging;             ///< a request that is older goes before all that are not
  std::optional<std::size_t> slots = 1;  ///< transfers at a time; none: as many as fill the uplink
  double uplink = 0;                     ///< bytes a second; 0: measured
  bool operator==(const Policy&) const = default;
};

/// What counts where nothing else is said: the best of those that bench/rules/run compared.
Policy default_policy();

/// Names and values as an operator writes them. `rule` and the rule's own options belong together.
struct PolicyLayer {
  std::optional<std::string> rule;
  std::map<std::string, std::string, std::less<>> options;  ///< common ones, and those of `rule`
  bool operator==(const PolicyLayer&) const = default;
};

/// An option that every rule has.
struct CommonOption {
  std::string_view name;
  std::string_view value;  ///< what it takes, for people
  std::string_view standard;
  std::string_view summary;
};
std::span<const CommonOption> common_options();

/// What is wrong with what.
struct PolicyError {
  std::string subject;  ///< "rule", or "option NAME"
  std::string text;     ///< goes on behind "SUBJECT: "
  bool is_rule = false;
  [[nodiscard]] std::string sentence() const { return subject + ": " + text; }
};

/// Checks one layer by itself: a rule that is unknown, an option that is unknown or that its rule has not, a value that
/// is none. A layer without a rule may have common options only.
std::optional<PolicyError> check(const PolicyLayer& layer);

/// Where a value comes from: the index of its layer, or none for the default.
using Source = std::optional<std::size_t>;

struct Resolved {
  Policy policy;
  Source rule_from;                                 ///< of the rule and its own options
  std::map<std::string, Source, std::less<>> from;  ///< of each common option, by name
};

/// The policy of several layers, the strongest first: the rule and its own options of the first layer that names a
/// rule, each common option of the first layer that has it. REQUIRES: check() found nothing in any of them.
Resolved resolve(std::span<const PolicyLayer> layers);

/// A policy as a layer that says everything, and as one line "fcsf aging=0 burst=2 quantum=0 slots=1 uplink=0".
PolicyLayer written(const Policy& policy);
std::string text_of(const Policy& policy);

/// Options as "name=value name=value", ascending by name, and back; none if that is no such text.
std::string join_options(const std::map<std::string, std::string, std::less<>>& options);
std::optional<std::map<std::string, std::string, std::less<>>> split_options(std::string_view text);

}  // namespace pmcd::scheduler
