// SPDX-License-Identifier: MIT
// Numbers with so many digits as can be trusted, columns that line up.
#include "sim/report.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <ostream>

#include "sim/policies.h"

namespace pmcd::sim {
namespace {

using nlohmann::ordered_json;

std::string fixed(double value, int digits) {
  std::array<char, 64> text{};
  std::snprintf(text.data(), text.size(), "%.*f", digits, value);
  return text.data();
}

std::string seconds(double value) {
  return value < 0 ? "-" : fixed(value, 3);
}

using TextRow = std::vector<std::string>;

/// The first `left` columns stand on the left.
void print_table(std::ostream& out, const std::vector<TextRow>& rows, std::size_t left) {
  std::vector<std::size_t> widths(rows.front().size());
  for (const TextRow& row : rows) {
    for (std::size_t i = 0; i < row.size(); ++i) widths[i] = std::max(widths[i], row[i].size());
  }
  for (const TextRow& row : rows) {
    std::string line;
    for (std::size_t i = 0; i < row.size(); ++i) {
      const std::string space(widths[i] - row[i].size(), ' ');
      line += (i == 0 ? "" : "  ") + (i < left ? row[i] + space : space + row[i]);
    }
    line.erase(line.find_last_not_of(' ') + 1);
    out << line << '\n';
  }
}

ordered_json number(double value) {
  if (value < 0) return nullptr;
  return std::round(value * 1e6) / 1e6;
}

ordered_json distribution_json(const Distribution& distribution) {
  return {{"count", distribution.count},
          {"mean", number(distribution.mean)},
          {"median", number(distribution.median)},
          {"p95", number(distribution.p95)},
          {"p99", number(distribution.p99)}};
}

ordered_json scenario_json(const Scenario& scenario) {
  ordered_json lines = ordered_json::array();
  for (const Line& line : scenario.lines) {
    lines.push_back({{"name", line.name},
                     {"down_kbit", line.down_kbit},
                     {"up_kbit", line.up_kbit},
                     {"rtt_ms", number(line.round_trip * 1000)},
                     {"weight", line.weight}});
  }
  ordered_json meshes = ordered_json::array();
  for (const Mesh& mesh : scenario.meshes) {
    meshes.push_back({{"name", mesh.name}, {"bytes", mesh.bytes}, {"packets", mesh.levels.size()}});
  }
  return {{"clients", scenario.clients.size()},
          {"uplink_kbit", scenario.uplink_kbit},
          {"open_requests", scenario.open},
          {"lines", std::move(lines)},
          {"meshes", std::move(meshes)}};
}

ordered_json clients_json(const Scenario& scenario, const Outcome& outcome) {
  ordered_json rows = ordered_json::array();
  for (const Fetch& fetch : outcome.fetches) {
    const ClientPlan& client = scenario.clients[fetch.client];
    rows.push_back({{"client", fetch.client + 1},
                    {"line", scenario.lines[client.line].name},
                    {"mesh", scenario.meshes[fetch.mesh].name},
                    {"bytes", scenario.meshes[fetch.mesh].bytes},
                    {"stalls", client.stalls || client.stalls_after},
                    {"begins", number(fetch.begins)},
                    {"first_level", number(fetch.first_level)},
                    {"to_10_percent", number(fetch.to_error[0])},
                    {"to_5_percent", number(fetch.to_error[1])},
                    {"to_1_percent", number(fetch.to_error[2])},
                    {"complete", number(fetch.complete)}});
  }
  return rows;
}

}  // namespace

std::string whole_title(const std::string& title, const Scenario& scenario) {
  std::array<char, 64> kbit{};
  std::snprintf(kbit.data(), kbit.size(), "%.10g", scenario.uplink_kbit);
  return title + "; the server's link carries " + kbit.data() + " kbit/s";
}

void print_heading(std::ostream& out, const std::string& title, const Scenario& scenario) {
  out << whole_title(title, scenario) << '\n'
      << "(uplink= in a policy is not that, but what the daemon is told of it; 0: it measures)\n\n";
}

void print_summaries(std::ostream& out, const Scenario& scenario, const std::vector<Run>& runs) {
  std::vector<TextRow> rows = {{"policy", "time to", "mean", "median", "p95", "p99", "count"}};
  for (const Run& run : runs) {
    const Summary summary = summarize(scenario, run.outcome);
    const std::pair<const char*, const Distribution*> lines[] = {
        {"first level", &summary.first_level}, {"10 % error", &summary.to_ten_percent}, {"complete", &summary.all}};
    for (const auto& [name, distribution] : lines) {
      rows.push_back({rows.size() % 3 == 1 ? text_of(run.policy) : "", name, seconds(distribution->mean),
                      seconds(distribution->median), seconds(distribution->p95), seconds(distribution->p99),
                      std::to_string(distribution->count)});
    }
  }
  print_table(out, rows, 2);
  out << '\n';
  rows = {{"policy", "fairness", "link use", "complete", "dropped", "simulated s"}};
  for (const Run& run : runs) {
    const Summary summary = summarize(scenario, run.outcome);
    rows.push_back({text_of(run.policy), fixed(summary.fairness, 3), fixed(100 * run.outcome.link_use, 1) + " %",
                    std::to_string(summary.complete) + " of " + std::to_string(summary.fetches),
                    std::to_string(run.outcome.dropped), fixed(run.outcome.seconds, 1)});
  }
  print_table(out, rows, 1);
}

void print_clients(std::ostream& out, const Scenario& scenario, const Run& run) {
  out << text_of(run.policy) << '\n';
  std::vector<TextRow> rows = {
      {"client", "line", "mesh", "begins", "packet 0", "10 % error", "5 % error", "1 % error", "complete"}};
  for (const Fetch& fetch : run.outcome.fetches) {
    const ClientPlan& client = scenario.clients[fetch.client];
    rows.push_back({std::to_string(fetch.client + 1) + (client.stalls || client.stalls_after ? " (stalls)" : ""),
                    scenario.lines[client.line].name, scenario.meshes[fetch.mesh].name, fixed(fetch.begins, 3),
                    seconds(fetch.first_level), seconds(fetch.to_error[0]), seconds(fetch.to_error[1]),
                    seconds(fetch.to_error[2]), seconds(fetch.complete)});
  }
  print_table(out, rows, 3);
  out << '\n';
}

std::string json_of(const std::string& title, const Scenario& scenario, const std::vector<Run>& runs, bool clients) {
  ordered_json list = ordered_json::array();
  for (const Run& run : runs) {
    const Summary summary = summarize(scenario, run.outcome);
    ordered_json object = {{"rule", rule_text(run.policy)},
                           {"policy", text_of(run.policy)},
                           {"first_level", distribution_json(summary.first_level)},
                           {"to_10_percent", distribution_json(summary.to_ten_percent)},
                           {"complete", distribution_json(summary.all)},
                           {"fairness", number(summary.fairness)},
                           {"link_use", number(run.outcome.link_use)},
                           {"fetches", summary.fetches},
                           {"dropped", run.outcome.dropped},
                           {"simulated_seconds", number(run.outcome.seconds)},
                           {"payload_bytes", run.outcome.payload_bytes},
                           {"chunks", run.outcome.chunks}};
    if (clients) object["clients"] = clients_json(scenario, run.outcome);
    list.push_back(std::move(object));
  }
  const ordered_json document = {{"title", title}, {"scenario", scenario_json(scenario)}, {"runs", std::move(list)}};
  return document.dump(2, ' ', false, ordered_json::error_handler_t::replace) + "\n";
}

}  // namespace pmcd::sim
