// SPDX-License-Identifier: MIT
// The JSON of the answers about rule, queue and clients; proto/admin_rules.h says which fields there are. It asks
// nobody anything.
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "daemon/net/policy_keeper.h"
#include "daemon/net/queue_view.h"
#include "daemon/store/rule_history.h"

namespace pmcd::net {

/// The uplink at present: bytes a second, 0 if not known, and whether that is a measurement.
struct UplinkView {
  double rate = 0;
  bool measured = false;
};

std::string rules_json();
std::string rule_json(const PolicyKeeper::Report& report, const UplinkView& uplink);
std::string change_json(const PolicyKeeper::Change& change, bool dry_run, const UplinkView& uplink);
std::string history_json(const store::RuleChanges& history);
std::string queue_json(const scheduler::Policy& policy, const QueueView& queue);
std::string clients_json(const UplinkView& uplink, const std::vector<std::pair<SessionView, ClientView>>& clients);
std::string explain_json(const scheduler::Policy& policy, const SessionView& session, const QueueView& queue);
std::string weight_json(const scheduler::Policy& policy, scheduler::SessionKey client, double weight, double before);

}  // namespace pmcd::net
