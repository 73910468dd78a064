// SPDX-License-Identifier: GPL-3.0-or-later
// Laying out rules, the active one and its changes.
#include "admin-cli/rule_text.h"

#include <algorithm>
#include <functional>
#include <map>

#include "admin-cli/amounts.h"
#include "proto/text.h"

namespace pmcd::admin {

namespace {

constexpr std::size_t kMaxWarningBytes = 4096;

std::string blanks(std::size_t count) {
  return std::string(count, ' ');
}

/// The words of an array, "1|2".
std::string words_of(const ordered_json& option) {
  const auto found = option.find("values");
  if (found == option.end() || !found->is_array()) return "-";
  std::string text;
  for (const ordered_json& word : *found) {
    if (word.is_string()) text += (text.empty() ? "" : "|") + proto::printable(word.get<std::string>(), 256);
  }
  return text;
}

std::string who(const ordered_json& by) {
  return "uid " + field(by, "uid") + ", pid " + field(by, "pid");
}

}  // namespace

Lines rules_lines(const ordered_json& document) {
  const ordered_json rules = rows_of(document, "rules");
  std::size_t width = 0;
  for (const ordered_json& rule : rules) width = std::max(width, width_of(field(rule, "name")));
  Lines lines;
  for (const ordered_json& rule : rules) {
    const std::string name = field(rule, "name");
    lines.push_back(name + blanks(width - width_of(name) + 2) + field(rule, "summary"));
    for (const ordered_json& option : rows_of(rule, "options")) {
      lines.push_back(blanks(width + 4) + field(option, "name") + "=" + words_of(option) + "  " +
                      field(option, "summary") + " (default " + field(option, "default") + ")");
    }
  }
  std::vector<Lines> common;
  for (const ordered_json& option : rows_of(document, "common_options")) {
    common.push_back({field(option, "name"), field(option, "value"),
                      field(option, "summary") + " (default " + field(option, "default") + ")"});
  }
  if (common.empty()) return lines;
  lines.emplace_back();
  lines.emplace_back("Options of every rule:");
  const Lines table = table_lines({{"", false}, {"", false}, {"", false}}, common);
  for (auto line = table.begin() + 1; line != table.end(); ++line) lines.push_back("  " + *line);
  return lines;
}

Lines rule_lines(const ordered_json& rule) {
  const ordered_json by = object_of(rule, "by");
  const auto uplink = number_of(rule, "uplink_kbit");
  std::string uplink_text = "not known yet";
  if (uplink) uplink_text = rate_text(uplink) + (is_true(rule, "uplink_measured") ? ", measured" : ", as configured");
  const std::vector<Lines> facts{{"rule", field(rule, "text")},
                                 {"version", field(rule, "version")},
                                 {"since", field(rule, "since")},
                                 {"by", by.empty() ? "the configuration" : who(by)},
                                 {"uplink", uplink_text}};
  Lines lines = table_lines({{"", false}, {"", false}}, facts);
  lines.front().clear();
  std::rotate(lines.begin(), lines.begin() + 1, lines.end());

  // What has no source of its own is an option of the rule, and comes with it.
  const ordered_json sources = object_of(rule, "sources");
  std::vector<Lines> values{{"rule", field(rule, "rule"), field(sources, "rule")}};
  const ordered_json options = object_of(rule, "options");
  for (const auto& [name, value] : options.items()) {
    const ordered_json option{{"value", value}};
    const bool common = sources.contains(name);
    values.push_back(
        {proto::printable(name, 256), field(option, "value"), field(sources, common ? name.c_str() : "rule")});
  }
  for (std::string& line : table_lines({{"name", false}, {"value", false}, {"from", false}}, values)) {
    lines.push_back(std::move(line));
  }
  return lines;
}

std::string change_line(const ordered_json& document) {
  const ordered_json after_rule = object_of(document, "after");
  const std::string before = field(object_of(document, "before"), "text");
  const std::string after = field(after_rule, "text");
  const bool dry_run = is_true(document, "dry_run");
  if (before == after) {
    if (is_true(document, "changed")) return "rule: " + after + " (now version " + field(after_rule, "version") + ")";
    if (!dry_run) return "rule: " + after + " (nothing changed)";
    if (is_true(document, "would_change")) return "rule: " + after + " (dry run: it would be a live change)";
    return "rule: " + after + " (dry run: nothing would change)";
  }
  return "rule: " + before + " -> " + after + (dry_run ? " (dry run: nothing was changed)" : "");
}

Lines change_warnings(const ordered_json& document) {
  Lines lines;
  const auto found = document.find("warnings");
  if (found == document.end() || !found->is_array()) return lines;
  for (const ordered_json& warning : *found) {
    if (warning.is_string()) lines.push_back(proto::printable(warning.get<std::string>(), kMaxWarningBytes));
  }
  return lines;
}

Lines history_lines(const ordered_json& document) {
  // By number, so that a damaged change stands where it happened.
  std::multimap<double, Lines, std::greater<>> by_number;
  for (const ordered_json& change : rows_of(document, "changes")) {
    const bool to_configuration = field(change, "rule") == "-";
    std::string policy = to_configuration ? "(the configuration)" : field(change, "rule");
    if (const std::string options = field(change, "options"); !to_configuration && options != "-" && !options.empty()) {
      policy += " " + options;
    }
    if (const std::string reverts = field(change, "reverts"); reverts != "-" && !to_configuration) {
      policy += " (back to " + reverts + ")";
    }
    by_number.insert(
        {number_of(change, "number").value_or(0),
         {field(change, "number"), field(change, "changed_at"), field(change, "uid"), field(change, "pid"), policy}});
  }
  for (const ordered_json& change : rows_of(document, "damaged")) {
    by_number.insert({number_of(change, "number").value_or(0),
                      {field(change, "number"), "-", "-", "-", "(damaged: " + field(change, "error") + ")"}});
  }
  std::vector<Lines> rows;
  for (auto& [number, row] : by_number) rows.push_back(std::move(row));
  return table_lines({{"number"}, {"changed_at", false}, {"uid"}, {"pid"}, {"rule", false}}, rows);
}

}  // namespace pmcd::admin
