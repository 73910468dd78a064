// SPDX-License-Identifier: GPL-3.0-or-later
// Laying out the queue and the clients.
#include "admin-cli/queue_text.h"

#include <algorithm>
#include <utility>

#include "admin-cli/amounts.h"

namespace pmcd::admin {

namespace {

void append(Lines& lines, Lines&& more) {
  for (std::string& line : more) lines.push_back(std::move(line));
}

/// The table of what a document has of the queue, behind a blank line; nothing if it has nothing.
void append_requests(Lines& lines, const ordered_json& document, bool marked) {
  const ordered_json requests = rows_of(document, "requests");
  if (requests.empty()) return;
  lines.emplace_back();
  append(lines, request_table(requests, marked));
  if (const std::size_t more = count_of(document, "more"); more > 0) {
    lines.push_back("... and " + std::to_string(more) + " more");
  }
}

}  // namespace

std::string queue_counts(const ordered_json& queue) {
  return field(queue, "waiting") + " waiting, " + field(queue, "running") + " running";
}

Lines request_table(const ordered_json& requests, bool marked) {
  std::vector<Column> columns{{"rank"}, {"state", false}, {"client"}, {"mesh", false},  {"packet"},
                              {"left"}, {"asked"},        {"queued"}, {"reason", false}};
  if (marked) columns.insert(columns.begin(), Column{" ", false});
  std::vector<Lines> rows;
  std::size_t last_rank = 0;
  for (const ordered_json& request : requests) {
    const std::size_t rank = count_of(request, "rank");
    if (rank > last_rank + 1) {
      rows.emplace_back(columns.size());
      rows.back()[marked ? 1 : 0] = "...";
    }
    last_rank = std::max(last_rank, rank);
    const bool is_list = field(request, "mesh").empty();
    Lines cells{field(request, "rank"),
                field(request, "state"),
                field(request, "client"),
                is_list ? "(mesh list)" : field(request, "mesh"),
                is_list ? "-" : field(request, "packet"),
                bytes_text(number_of(request, "bytes_left")),
                seconds_text(number_of(request, "asked_seconds_ago")),
                seconds_text(number_of(request, "queued_seconds_ago")),
                field(request, "reason")};
    if (marked) cells.insert(cells.begin(), is_true(request, "mine") ? "*" : " ");
    rows.push_back(std::move(cells));
  }
  return table_lines(columns, rows);
}

Lines queue_lines(const ordered_json& queue) {
  Lines lines{"rule: " + field(queue, "text"), queue_counts(queue)};
  append_requests(lines, queue, false);
  return lines;
}

std::string level_text(const ordered_json& client) {
  const std::string level = field(client, "level");
  return level == "-" ? level : level + "/" + field(client, "levels");
}

Lines clients_lines(const ordered_json& document) {
  std::vector<Lines> rows;
  for (const ordered_json& client : rows_of(document, "clients")) {
    rows.push_back({field(client, "client"), field(client, "address"), rate_text(number_of(client, "speed_kbit")),
                    rate_text(number_of(client, "taking_kbit")), weight_text(number_of(client, "weight")),
                    bytes_text(number_of(client, "bytes")), share_text(number_of(client, "share")), level_text(client),
                    field(client, "waiting"), field(client, "running"),
                    seconds_text(number_of(client, "connected_seconds")), field(client, "mesh")});
  }
  Lines lines = table_lines({{"client"},
                             {"address", false},
                             {"speed"},
                             {"taking"},
                             {"weight"},
                             {"bytes"},
                             {"share"},
                             {"level"},
                             {"waiting"},
                             {"running"},
                             {"connected"},
                             {"mesh", false}},
                            rows);
  const auto uplink = number_of(document, "uplink_kbit");
  lines.emplace_back();
  lines.push_back("uplink: " + (uplink ? rate_text(uplink) : std::string("not known yet")));
  return lines;
}

Lines explain_lines(const ordered_json& document) {
  Lines lines{
      "client " + field(document, "client") + " (" + field(document, "address") + "): " + field(document, "summary"),
      "rule: " + field(document, "text"), queue_counts(document)};
  append_requests(lines, document, true);
  return lines;
}

std::string weight_line(const ordered_json& document) {
  std::string line = "client " + field(document, "client") + ": weight " + weight_text(number_of(document, "before")) +
                     " -> " + weight_text(number_of(document, "weight"));
  if (document.contains("counts") && !is_true(document, "counts")) {
    line += " (does not count now: the rule " + field(document, "rule") + " goes by no weights)";
  }
  return line;
}

}  // namespace pmcd::admin
