// SPDX-License-Identifier: MIT
// The distribution policy that is in force, where it comes from, and how it is changed while the daemon serves:
// checked, written to the database, then applied. It decides nothing about requests, and reads no configuration.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "daemon/net/asio.h"
#include "daemon/net/socket_state.h"
#include "daemon/scheduler/policy.h"
#include "daemon/store/rule_history.h"
#include "daemon/store/store_thread.h"
#include "proto/admin_rules.h"
#include "proto/codes.h"

namespace pmcd::net {

/// What the daemon starts with.
struct PolicySources {
  scheduler::PolicyLayer command_line;
  scheduler::PolicyLayer config_file;
  store::LastChange live;  ///< of earlier runs
};

/// At the start the command line goes before the last live change, and that before the config file; a change made while
/// the daemon runs goes before all of them.
class PolicyKeeper {
 public:
  /// `apply` makes a policy the one that decides, on the loop. REQUIRES: `writer` outlives the keeper and its
  /// coroutines, and check() finds nothing in the layers of command line and config file. A live change that an older
  /// or newer daemon wrote and this one does not understand is left out and logged; one that is damaged is logged, and
  /// the one before it counts.
  PolicyKeeper(Executor executor, store::StoreThread& writer, PolicySources sources,
               std::function<void(const scheduler::Policy&)> apply);
  PolicyKeeper(const PolicyKeeper&) = delete;
  PolicyKeeper& operator=(const PolicyKeeper&) = delete;

  [[nodiscard]] const scheduler::Policy& policy() const { return resolved_.policy; }

  /// The policy in force, for people and programs.
  struct Report {
    scheduler::Policy policy;
    std::int64_t version = 0;        ///< number of the last live change, damaged or not; 0: none
    std::int64_t since = 0;          ///< seconds since 1970
    std::optional<PeerIdentity> by;  ///< none: configuration
    std::string rule_from;
    std::vector<std::pair<std::string, std::string>> from;  ///< of each common option
  };
  [[nodiscard]] Report report() const;

  struct Change {
    bool changed = false;
    bool would_change = false;  ///< the same of a dry run, if it were none
    double seconds = 0;  ///< from the command to the new policy in force, its commit included; 0: nothing changed
    std::vector<std::string> warnings;
    Report before;
    Report after;
  };
  struct Refusal {
    proto::ErrorCode code = proto::ErrorCode::none;
    std::string text;
  };
  /// Makes `layer` the live change, in one step that is on the disk before it counts; a dry run only says what would
  /// be. Refusals: bad_rule, bad_option, version_changed, storage_failed; the old policy goes on.
  awaitable<std::variant<Change, Refusal>> set(scheduler::PolicyLayer layer, proto::ChangeTerms terms,
                                               PeerIdentity who);
  /// Goes back to what change `number` of the history said; 0: to the configuration. Refusals: as set(),
  /// unknown_change, and storage_failed also when that change is damaged.
  awaitable<std::variant<Change, Refusal>> revert(std::uint64_t number, proto::ChangeTerms terms, PeerIdentity who);
  /// The newest; `most` 0: all that are kept.
  awaitable<store::Result<store::RuleChanges>> history(std::uint32_t most);

 private:
  /// The layers in the order in which they count now, or would after a restart with this live change.
  enum class When : std::uint8_t { now, after_restart };
  [[nodiscard]] scheduler::Resolved resolve(const std::optional<scheduler::PolicyLayer>& live, When when) const;
  [[nodiscard]] Report report_of(const scheduler::Resolved& resolved,
                                 const std::optional<store::RuleChange>& live) const;
  [[nodiscard]] std::vector<std::string> warnings(const std::optional<scheduler::PolicyLayer>& live) const;
  awaitable<std::variant<Change, Refusal>> change(std::optional<scheduler::PolicyLayer> layer,
                                                  std::optional<std::int64_t> reverts, proto::ChangeTerms terms,
                                                  PeerIdentity who);

  const Executor executor_;
  store::StoreThread& writer_;
  const scheduler::PolicyLayer command_line_;
  const scheduler::PolicyLayer config_file_;
  const std::function<void(const scheduler::Policy&)> apply_;
  const std::int64_t started_at_;
  std::optional<scheduler::PolicyLayer> live_;  ///< what the last change said; none: nothing, or back to configuration
  std::optional<store::RuleChange> last_;       ///< the last change that is whole
  std::int64_t version_;                        ///< number of the last change; above last_'s: it is damaged
  bool changed_here_ = false;                   ///< it was made in this run
  scheduler::Resolved resolved_;
};

}  // namespace pmcd::net
