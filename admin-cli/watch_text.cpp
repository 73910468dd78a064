// SPDX-License-Identifier: GPL-3.0-or-later
// Sharing a terminal's lines between clients and queue.
#include "admin-cli/watch_text.h"

#include <algorithm>
#include <limits>
#include <utility>
#include <vector>

#include "admin-cli/amounts.h"
#include "admin-cli/queue_text.h"

namespace pmcd::admin {

namespace {

constexpr std::size_t kLevelBar = 8;
constexpr std::size_t kUplinkBar = 16;
constexpr std::size_t kNoLimit = std::numeric_limits<std::size_t>::max();

std::string uplink_text(const Snapshot& snapshot) {
  double used = 0;
  for (const ordered_json& client : rows_of(snapshot.clients, "clients")) {
    used += number_of(client, "taking_kbit").value_or(0);
  }
  auto whole = number_of(snapshot.clients, "uplink_kbit");
  if (!whole) whole = number_of(snapshot.rule, "uplink_kbit");
  std::string text = "uplink " + rate_text(used);
  if (!whole || *whole <= 0) return text + " of an unknown rate";
  return text + " of " + rate_text(whole) + " " + bar_text(used / *whole, kUplinkBar);
}

/// 0: is served, 1: waits, 2: neither.
int idleness(const ordered_json& client) {
  if (count_of(client, "running") > 0) return 0;
  return count_of(client, "waiting") > 0 ? 1 : 2;
}

std::string level_bar(const ordered_json& client) {
  const auto level = number_of(client, "level");
  const auto levels = number_of(client, "levels");
  if (!level || !levels || *levels <= 0) return level_text(client);
  return bar_text(*level / *levels, kLevelBar) + " " + level_text(client);
}

Lines client_table(const ordered_json& document) {
  const ordered_json rows = rows_of(document, "clients");
  std::vector<ordered_json> clients(rows.begin(), rows.end());
  std::stable_sort(clients.begin(), clients.end(),
                   [](const ordered_json& a, const ordered_json& b) { return idleness(a) < idleness(b); });
  std::vector<Lines> table;
  table.reserve(clients.size());
  for (const ordered_json& client : clients) {
    table.push_back({field(client, "client"), rate_text(number_of(client, "speed_kbit")),
                     rate_text(number_of(client, "taking_kbit")), bytes_text(number_of(client, "bytes")),
                     share_text(number_of(client, "share")), level_bar(client), field(client, "mesh")});
  }
  return table_lines({{"client"}, {"speed"}, {"taking"}, {"bytes"}, {"share"}, {"level", false}, {"mesh", false}},
                     table);
}

/// A table's head line and as many others as fit into `room` lines; where not all do, the last of them says how many
/// are missing. `beyond`: lines that are missing already.
void append_table(Lines& lines, const Lines& table, std::size_t room, std::size_t beyond) {
  if (room == 0) return;
  std::size_t shown = std::min(table.size(), room);
  if (shown < table.size() || beyond > 0) shown = std::min(table.size(), room - 1);
  lines.insert(lines.end(), table.begin(), table.begin() + static_cast<std::ptrdiff_t>(shown));
  // Without the head line there is nothing to count on.
  const std::size_t missing = table.size() - std::max<std::size_t>(shown, 1) + beyond;
  if (missing > 0) lines.push_back("... and " + std::to_string(missing) + " more");
}

}  // namespace

Lines snapshot_lines(const Snapshot& snapshot, const ScreenSize& size) {
  Lines lines{field(snapshot.rule, "text") + "  version " + field(snapshot.rule, "version"), uplink_text(snapshot)};
  const Lines clients = client_table(snapshot.clients);
  const ordered_json requests = rows_of(snapshot.queue, "requests");
  const Lines queue = requests.empty() ? Lines{} : request_table(requests, false);
  const std::size_t beyond = count_of(snapshot.queue, "more");

  // The head of two lines, a blank line, the clients, a blank line, the counts of the queue, the queue.
  constexpr std::size_t kFixed = 5;
  const std::size_t room = size.rows ? *size.rows - std::min(*size.rows, kFixed) : kNoLimit;
  const std::size_t queue_wants = queue.empty() ? 0 : queue.size() + (beyond > 0 ? 1 : 0);
  const std::size_t for_clients = std::min(clients.size(), std::max(room / 2, room - std::min(room, queue_wants)));

  lines.emplace_back();
  append_table(lines, clients, for_clients, 0);
  lines.emplace_back();
  lines.push_back("queue: " + queue_counts(snapshot.queue));
  if (!queue.empty()) append_table(lines, queue, room - for_clients, beyond);

  if (size.rows) lines.resize(std::min(lines.size(), *size.rows));
  if (size.columns) {
    for (std::string& line : lines) line = cut_to(line, *size.columns);
  }
  return lines;
}

}  // namespace pmcd::admin
