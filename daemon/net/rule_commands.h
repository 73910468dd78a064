// SPDX-License-Identifier: MIT
// The operator's commands about who is served next: the rule and its changes, the queue, the clients. Each takes a
// message of proto/admin_rules.h and makes the JSON that proto/admin_rules.h describes. It sends nothing itself.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "daemon/net/asio.h"
#include "daemon/net/dispatcher.h"
#include "daemon/net/policy_keeper.h"
#include "daemon/net/queue_view.h"
#include "proto/admin_rules.h"

namespace pmcd::net {

class RuleCommands {
 public:
  /// `sessions`: all that stand, ascending by key. REQUIRES: all outlive it.
  RuleCommands(PolicyKeeper& policy, Dispatcher& dispatcher, std::function<std::vector<SessionView>()> sessions)
      : policy_(policy), dispatcher_(dispatcher), sessions_(std::move(sessions)) {}

  struct Answer {
    std::uint32_t id = 0;
    std::string json;
    proto::ErrorCode code = proto::ErrorCode::none;  ///< not none: refused, with `text` instead of `json`
    std::string text;
    std::string command;  ///< for the log
    std::string about;
    bool changes = false;  ///< worth a line in the log
  };
  /// The answer to a message of that type; an error of the protocol if the body has not its form; none if the type is
  /// none of these commands.
  awaitable<std::optional<std::variant<Answer, proto::Error>>> answer(proto::FrameType type, proto::ByteView body,
                                                                      PeerIdentity who);

 private:
  awaitable<Answer> set_rule(proto::AdminSetRule message, PeerIdentity who);
  awaitable<Answer> revert(proto::AdminRevert message, PeerIdentity who);
  awaitable<Answer> history(proto::AdminHistory message);
  Answer explain(const proto::AdminExplain& message);
  Answer weight(const proto::AdminWeight& message);

  PolicyKeeper& policy_;
  Dispatcher& dispatcher_;
  std::function<std::vector<SessionView>()> sessions_;
};

}  // namespace pmcd::net
