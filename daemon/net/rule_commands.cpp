// SPDX-License-Identifier: MIT
// From messages to what the keeper and the dispatcher are asked.
#include "daemon/net/rule_commands.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <limits>
#include <utility>

#include "daemon/net/rule_json.h"

namespace pmcd::net {
namespace {

using proto::ErrorCode;
using proto::FrameType;

constexpr std::size_t kMostRequests = 1'000;
constexpr std::size_t kAllRequests = std::numeric_limits<std::size_t>::max();

UplinkView uplink_of(const Dispatcher& dispatcher) {
  return {dispatcher.uplink(), dispatcher.policy().uplink <= 0};
}

RuleCommands::Answer refused(std::uint32_t id, ErrorCode code, std::string text) {
  RuleCommands::Answer answer;
  answer.id = id;
  answer.code = code;
  answer.text = std::move(text);
  return answer;
}

const SessionView* find(const std::vector<SessionView>& sessions, std::uint64_t key) {
  const auto it =
      std::find_if(sessions.begin(), sessions.end(), [key](const SessionView& session) { return session.key == key; });
  return it == sessions.end() ? nullptr : &*it;
}

RuleCommands::Answer with(std::uint32_t id, std::string json) {
  RuleCommands::Answer answer;
  answer.id = id;
  answer.json = std::move(json);
  return answer;
}

RuleCommands::Answer changed(std::uint32_t id, const std::variant<PolicyKeeper::Change, PolicyKeeper::Refusal>& outcome,
                             bool dry_run, const UplinkView& uplink) {
  if (const auto* refusal = std::get_if<PolicyKeeper::Refusal>(&outcome)) {
    return refused(id, refusal->code, refusal->text);
  }
  const auto& change = std::get<PolicyKeeper::Change>(outcome);
  auto answer = with(id, change_json(change, dry_run, uplink));
  answer.about = scheduler::text_of(change.before.policy) + " -> " + scheduler::text_of(change.after.policy);
  if (dry_run) answer.about += " (dry run)";
  if (change.seconds > 0) answer.about += fmt::format(" in {:.1f} ms", change.seconds * 1000);
  if (!dry_run && !change.changed) answer.about = "as it was";
  return answer;
}

}  // namespace

awaitable<std::optional<std::variant<RuleCommands::Answer, proto::Error>>> RuleCommands::answer(FrameType type,
                                                                                                proto::ByteView body,
                                                                                                PeerIdentity who) {
  using Outcome = std::variant<Answer, proto::Error>;
  const auto named = [](Answer answer, std::string command) -> Outcome {
    answer.command = std::move(command);
    return answer;
  };
  switch (type) {
    case FrameType::admin_rules: {
      const auto message = proto::decode<proto::AdminRules>(body);
      if (!message) co_return message.error();
      co_return named(with(message.value().id, rules_json()), "rules");
    }
    case FrameType::admin_rule: {
      const auto message = proto::decode<proto::AdminRule>(body);
      if (!message) co_return message.error();
      co_return named(with(message.value().id, rule_json(policy_.report(), uplink_of(dispatcher_))), "rule");
    }
    case FrameType::admin_set_rule: {
      auto message = proto::decode<proto::AdminSetRule>(body);
      if (!message) co_return message.error();
      Answer answer = co_await set_rule(std::move(message).value(), who);
      co_return named(std::move(answer), "set-rule");
    }
    case FrameType::admin_revert: {
      const auto message = proto::decode<proto::AdminRevert>(body);
      if (!message) co_return message.error();
      Answer answer = co_await revert(message.value(), who);
      co_return named(std::move(answer), "revert");
    }
    case FrameType::admin_history: {
      const auto message = proto::decode<proto::AdminHistory>(body);
      if (!message) co_return message.error();
      Answer answer = co_await history(message.value());
      co_return named(std::move(answer), "history");
    }
    case FrameType::admin_queue: {
      const auto message = proto::decode<proto::AdminQueue>(body);
      if (!message) co_return message.error();
      co_return named(with(message.value().id, queue_json(dispatcher_.policy(), dispatcher_.queue(kMostRequests))),
                      "queue");
    }
    case FrameType::admin_clients: {
      const auto message = proto::decode<proto::AdminClients>(body);
      if (!message) co_return message.error();
      std::vector<std::pair<SessionView, ClientView>> clients;
      for (SessionView& session : sessions_()) {
        ClientView client = dispatcher_.client(session.key);
        clients.emplace_back(std::move(session), client);
      }
      co_return named(with(message.value().id, clients_json(uplink_of(dispatcher_), clients)), "clients");
    }
    case FrameType::admin_explain: {
      const auto message = proto::decode<proto::AdminExplain>(body);
      if (!message) co_return message.error();
      co_return named(explain(message.value()), "explain");
    }
    case FrameType::admin_weight: {
      const auto message = proto::decode<proto::AdminWeight>(body);
      if (!message) co_return message.error();
      co_return named(weight(message.value()), "weight");
    }
    default:
      co_return std::nullopt;
  }
}

awaitable<RuleCommands::Answer> RuleCommands::set_rule(proto::AdminSetRule message, PeerIdentity who) {
  scheduler::PolicyLayer layer;
  layer.rule = message.rule;
  for (const proto::RuleOptionText& option : message.options) {
    if (layer.options.emplace(option.name, option.value).second) continue;
    co_return refused(message.id, ErrorCode::bad_option, "option " + option.name + ": is given twice");
  }
  const auto outcome = co_await policy_.set(std::move(layer), message.terms, who);
  Answer answer = changed(message.id, outcome, message.terms.dry_run, uplink_of(dispatcher_));
  answer.changes = true;
  co_return answer;
}

awaitable<RuleCommands::Answer> RuleCommands::revert(proto::AdminRevert message, PeerIdentity who) {
  const auto outcome = co_await policy_.revert(message.change, message.terms, who);
  Answer answer = changed(message.id, outcome, message.terms.dry_run, uplink_of(dispatcher_));
  answer.changes = true;
  co_return answer;
}

awaitable<RuleCommands::Answer> RuleCommands::history(proto::AdminHistory message) {
  const auto changes = co_await policy_.history(message.most);
  if (!changes) co_return refused(message.id, ErrorCode::storage_failed, changes.error().detail);
  co_return with(message.id, history_json(changes.value()));
}

RuleCommands::Answer RuleCommands::explain(const proto::AdminExplain& message) {
  const auto sessions = sessions_();
  const SessionView* session = find(sessions, message.session);
  if (session == nullptr) {
    return refused(message.id, ErrorCode::unknown_client, "there is no client " + std::to_string(message.session));
  }
  // The places of the client's requests show only among all of them.
  QueueView queue = dispatcher_.queue(kAllRequests);
  shorten(queue, kMostRequests, message.session);
  return with(message.id, explain_json(dispatcher_.policy(), *session, queue));
}

RuleCommands::Answer RuleCommands::weight(const proto::AdminWeight& message) {
  const auto sessions = sessions_();
  if (find(sessions, message.session) == nullptr) {
    return refused(message.id, ErrorCode::unknown_client, "there is no client " + std::to_string(message.session));
  }
  const double before = dispatcher_.client(message.session).weight;
  const double weight = static_cast<double>(message.weight) / proto::kWeightOne;
  dispatcher_.set_weight(message.session, weight);
  Answer answer = with(message.id, weight_json(dispatcher_.policy(), message.session, weight, before));
  answer.about = fmt::format("client {}: weight {} -> {}", message.session, before, weight);
  answer.changes = true;
  return answer;
}

}  // namespace pmcd::net
