// SPDX-License-Identifier: MIT
// Answers as JSON text, and the sentence that explains a client's place.
#include "daemon/net/rule_json.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "daemon/net/admin_json.h"

namespace pmcd::net {
namespace {

using Json = nlohmann::ordered_json;

std::string dumped(const Json& json) {
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

/// Three decimals are enough for people, and do not pretend.
double rounded(double value) {
  return std::round(value * 1000) / 1000;
}

Json kbit(double bytes_a_second) {
  return rounded(bytes_a_second / 125);
}

Json uplink_kbit(const UplinkView& uplink) {
  return uplink.rate > 0 ? kbit(uplink.rate) : Json(nullptr);
}

Json policy_object(const PolicyKeeper::Report& report, const UplinkView& uplink) {
  Json options = Json::object();
  for (const auto& [name, value] : scheduler::written(report.policy).options) options[name] = value;
  Json sources{{"rule", report.rule_from}};
  for (const auto& [name, source] : report.from) sources[name] = source;
  return {{"rule", report.policy.rule},
          {"text", scheduler::text_of(report.policy)},
          {"options", std::move(options)},
          {"version", report.version},
          {"since", utc_time(report.since)},
          {"by", report.by ? Json{{"uid", report.by->uid}, {"pid", report.by->pid}} : Json(nullptr)},
          {"sources", std::move(sources)},
          {"uplink_kbit", uplink_kbit(uplink)},
          {"uplink_measured", uplink.measured}};
}

const char* state_name(RequestView::State state) {
  switch (state) {
    case RequestView::State::running:
      return "running";
    case RequestView::State::waiting:
      return "waiting";
    case RequestView::State::blocked:
      break;
  }
  return "blocked";
}

Json request_object(const RequestView& request) {
  return {{"rank", request.rank},
          {"state", state_name(request.state)},
          {"client", request.client},
          {"address", request.address},
          {"mesh", request.mesh},
          {"packet", request.packet},
          {"bytes_left", request.bytes_left},
          {"bytes", request.bytes},
          {"asked_seconds_ago", rounded(request.asked_seconds_ago)},
          {"queued_seconds_ago", rounded(request.queued_seconds_ago)},
          {"reason", request.reason}};
}

std::string what(const RequestView& request) {
  if (request.mesh.empty()) return "the mesh list";
  return "packet " + std::to_string(request.packet) + " of \"" + request.mesh + "\"";
}

/// Says it of the client, which is not named.
std::string summary_of(const QueueView& queue, const RequestView* mine) {
  if (mine == nullptr) return "has asked for nothing that is not sent yet";
  if (mine->state == RequestView::State::running) return "is being served: " + what(*mine);
  if (mine->state == RequestView::State::blocked) {
    return "was interrupted and has not taken yet what was sent of " + what(*mine);
  }
  if (mine->rank == 1) return "is next with " + what(*mine) + ": " + mine->reason;
  const auto first = std::find_if(queue.requests.begin(), queue.requests.end(),
                                  [](const RequestView& request) { return request.rank == 1; });
  return "waits for " + what(*mine) + " behind " + std::to_string(mine->rank - 1) +
         (mine->rank == 2 ? " other: " : " others: ") + mine->reason + "; next is client " +
         std::to_string(first->client) + ": " + first->reason;
}

}  // namespace

std::string rules_json() {
  Json rules = Json::array();
  for (const scheduler::RuleEntry& rule : scheduler::all_rules()) {
    Json options = Json::array();
    for (const scheduler::RuleOption& option : rule.options) {
      options.push_back({{"name", option.name},
                         {"values", std::vector<std::string>(option.words.begin(), option.words.end())},
                         {"default", option.words.front()},
                         {"summary", option.summary}});
    }
    rules.push_back({{"name", rule.name}, {"summary", rule.summary}, {"options", std::move(options)}});
  }
  Json common = Json::array();
  for (const scheduler::CommonOption& option : scheduler::common_options()) {
    common.push_back(
        {{"name", option.name}, {"value", option.value}, {"default", option.standard}, {"summary", option.summary}});
  }
  return dumped({{"rules", std::move(rules)}, {"common_options", std::move(common)}});
}

std::string rule_json(const PolicyKeeper::Report& report, const UplinkView& uplink) {
  return dumped(policy_object(report, uplink));
}

std::string change_json(const PolicyKeeper::Change& change, bool dry_run, const UplinkView& uplink) {
  return dumped({{"changed", change.changed},
                 {"would_change", change.would_change},
                 {"dry_run", dry_run},
                 {"seconds", change.seconds},
                 {"warnings", change.warnings},
                 {"before", policy_object(change.before, uplink)},
                 {"after", policy_object(change.after, uplink)}});
}

std::string history_json(const store::RuleChanges& history) {
  Json rows = Json::array();
  for (const store::RuleChange& change : history.changes) {
    rows.push_back({{"number", change.number},
                    {"changed_at", utc_time(change.changed_at)},
                    {"rule", change.rule ? Json(*change.rule) : Json(nullptr)},
                    {"options", change.options},
                    {"uid", change.uid},
                    {"pid", change.pid},
                    {"reverts", change.reverts ? Json(*change.reverts) : Json(nullptr)}});
  }
  Json damaged = Json::array();
  for (const auto& [number, error] : history.damaged) damaged.push_back({{"number", number}, {"error", error}});
  return dumped({{"changes", std::move(rows)}, {"damaged", std::move(damaged)}});
}

std::string queue_json(const scheduler::Policy& policy, const QueueView& queue) {
  Json requests = Json::array();
  for (const RequestView& request : queue.requests) requests.push_back(request_object(request));
  return dumped({{"rule", policy.rule},
                 {"text", scheduler::text_of(policy)},
                 {"waiting", queue.waiting},
                 {"running", queue.running},
                 {"requests", std::move(requests)},
                 {"more", queue.more}});
}

std::string clients_json(const UplinkView& uplink, const std::vector<std::pair<SessionView, ClientView>>& clients) {
  std::uint64_t all = 0;
  for (const auto& [session, client] : clients) all += client.acknowledged;
  Json rows = Json::array();
  for (const auto& [session, client] : clients) {
    const double share = all > 0 ? static_cast<double>(client.acknowledged) / static_cast<double>(all) : 0;
    rows.push_back({{"client", session.key},
                    {"address", session.address},
                    {"speed_kbit", client.speed ? kbit(*client.speed) : Json(nullptr)},
                    {"taking_kbit", kbit(client.taking)},
                    {"weight", client.weight},
                    {"bytes", client.acknowledged},
                    {"share", rounded(share)},
                    {"mesh", session.mesh ? Json(*session.mesh) : Json(nullptr)},
                    {"level", session.mesh ? Json(session.level) : Json(nullptr)},
                    {"levels", session.mesh ? Json(session.levels) : Json(nullptr)},
                    {"waiting", client.waiting},
                    {"running", client.running},
                    {"connected_seconds", rounded(session.connected_seconds)}});
  }
  return dumped({{"uplink_kbit", uplink_kbit(uplink)}, {"clients", std::move(rows)}});
}

std::string explain_json(const scheduler::Policy& policy, const SessionView& session, const QueueView& queue) {
  Json requests = Json::array();
  const RequestView* first = nullptr;  // of the client's own; what is blocked hides nothing that waits
  for (const RequestView& request : queue.requests) {
    Json object = request_object(request);
    if (request.client == session.key) {
      object["mine"] = true;
      if (first == nullptr || (first->state == RequestView::State::blocked && request.rank > 0)) first = &request;
    }
    requests.push_back(std::move(object));
  }
  const bool next = first != nullptr && (first->state == RequestView::State::running || first->rank == 1);
  return dumped({{"client", session.key},
                 {"address", session.address},
                 {"rule", policy.rule},
                 {"text", scheduler::text_of(policy)},
                 {"next", next},
                 {"summary", summary_of(queue, first)},
                 {"waiting", queue.waiting},
                 {"running", queue.running},
                 {"requests", std::move(requests)},
                 {"more", queue.more}});
}

std::string weight_json(const scheduler::Policy& policy, scheduler::SessionKey client, double weight, double before) {
  return dumped({{"client", client},
                 {"weight", weight},
                 {"before", before},
                 {"rule", policy.rule},
                 {"counts", scheduler::find_rule(policy.rule)->goes_by_weight}});
}

}  // namespace pmcd::net
