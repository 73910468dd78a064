// SPDX-License-Identifier: GPL-3.0-or-later
// Fields and tables.
#include "admin-cli/document.h"

#include <algorithm>
#include <cstdio>

#include "proto/text.h"

namespace pmcd::admin {

namespace {

constexpr std::size_t kMaxFieldBytes = 4096;

bool begins_character(char c) {
  return (static_cast<unsigned char>(c) & 0xc0) != 0x80;
}

}  // namespace

std::string field(const ordered_json& object, const char* name) {
  const auto found = object.find(name);
  if (found == object.end() || found->is_null()) return "-";
  if (found->is_string()) return proto::printable(found->get<std::string>(), kMaxFieldBytes);
  if (found->is_number_float()) {
    char text[32];
    std::snprintf(text, sizeof text, "%.4g", found->get<double>());
    return text;
  }
  const std::string text = found->dump(-1, ' ', false, ordered_json::error_handler_t::replace);
  return proto::printable(text, kMaxFieldBytes);
}

std::optional<double> number_of(const ordered_json& object, const char* name) {
  const auto found = object.find(name);
  if (found == object.end() || !found->is_number()) return std::nullopt;
  return found->get<double>();
}

std::size_t count_of(const ordered_json& object, const char* name) {
  const auto found = object.find(name);
  if (found == object.end() || !found->is_number_integer() || *found < 0) return 0;
  return found->get<std::size_t>();
}

bool is_true(const ordered_json& object, const char* name) {
  const auto found = object.find(name);
  return found != object.end() && found->is_boolean() && found->get<bool>();
}

ordered_json object_of(const ordered_json& document, const char* name) {
  const auto found = document.find(name);
  return found != document.end() && found->is_object() ? *found : ordered_json::object();
}

ordered_json rows_of(const ordered_json& document, const char* name) {
  const auto found = document.find(name);
  if (found == document.end() || !found->is_array()) return ordered_json::array();
  ordered_json rows = ordered_json::array();
  for (const ordered_json& row : *found) {
    if (row.is_object()) rows.push_back(row);
  }
  return rows;
}

std::size_t width_of(const std::string& text) {
  return static_cast<std::size_t>(std::count_if(text.begin(), text.end(), begins_character));
}

std::string cut_to(const std::string& text, std::size_t width) {
  std::size_t at = 0;
  for (; at < text.size(); ++at) {
    if (!begins_character(text[at])) continue;
    if (width == 0) break;
    --width;
  }
  return text.substr(0, at);
}

Lines table_lines(const std::vector<Column>& columns, const std::vector<Lines>& rows) {
  std::vector<Lines> table(1);
  for (const Column& column : columns) table.front().push_back(column.head);
  table.insert(table.end(), rows.begin(), rows.end());
  std::vector<std::size_t> widths(columns.size(), 0);
  for (const Lines& cells : table) {
    for (std::size_t i = 0; i < columns.size(); ++i) widths[i] = std::max(widths[i], width_of(cells[i]));
  }
  Lines lines;
  lines.reserve(table.size());
  for (const Lines& cells : table) {
    std::string line;
    for (std::size_t i = 0; i < columns.size(); ++i) {
      const std::string blanks(widths[i] - width_of(cells[i]), ' ');
      if (i > 0) line += "  ";
      line += columns[i].right ? blanks + cells[i] : cells[i] + blanks;
    }
    line.erase(line.find_last_not_of(' ') + 1);
    lines.push_back(std::move(line));
  }
  return lines;
}

Lines table_of(const ordered_json& rows, const std::vector<const char*>& names) {
  std::vector<Column> columns;
  columns.reserve(names.size());
  for (const char* name : names) columns.push_back({name, !columns.empty()});
  std::vector<Lines> table;
  for (const ordered_json& row : rows) {
    Lines cells;
    cells.reserve(names.size());
    for (const char* name : names) cells.push_back(field(row, name));
    table.push_back(std::move(cells));
  }
  return table_lines(columns, table);
}

Lines field_lines(const ordered_json& object) {
  std::vector<Lines> rows;
  for (const auto& item : object.items()) {
    if (item.key() != "levels") rows.push_back({item.key(), field(object, item.key().c_str())});
  }
  Lines lines = table_lines({{"", false}, {"", false}}, rows);
  lines.erase(lines.begin());
  return lines;
}

}  // namespace pmcd::admin
