// SPDX-License-Identifier: GPL-3.0-or-later
// Reading the daemon's JSON documents and laying them out as lines: fields, rows, tables. Whatever the document lacks
// or has in another form is "-", never an error. Prints nothing and knows no command.
#pragma once

#include <cstddef>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

namespace pmcd::admin {

using nlohmann::ordered_json;

using Lines = std::vector<std::string>;

/// A field as a person reads it: text without quotes and without what a terminal would obey, everything else as JSON,
/// "-" when it is missing or null.
std::string field(const ordered_json& object, const char* name);

/// The field as a number; none when it is missing, null or no number.
std::optional<double> number_of(const ordered_json& object, const char* name);

/// The field as a count; 0 when it is none.
std::size_t count_of(const ordered_json& object, const char* name);

/// True only when the field is there and true.
bool is_true(const ordered_json& object, const char* name);

/// The object of that name, an empty one when there is none.
ordered_json object_of(const ordered_json& document, const char* name);

/// The objects in the array of that name; an empty array when there is none.
ordered_json rows_of(const ordered_json& document, const char* name);

/// Characters, not bytes. Wide characters count as one.
std::size_t width_of(const std::string& text);

/// The text's first `width` characters.
std::string cut_to(const std::string& text, std::size_t width);

struct Column {
  std::string head;
  bool right = true;  ///< its cells stand right, as numbers do
};

/// A table with a head line; no line ends with blanks. REQUIRES: each row has as many cells as there are columns.
Lines table_lines(const std::vector<Column>& columns, const std::vector<Lines>& rows);

/// The table of these fields of each row; the first column stands left, the others right.
Lines table_of(const ordered_json& rows, const std::vector<const char*>& names);

/// A line for each field but `levels`, which is a table of its own.
Lines field_lines(const ordered_json& object);

}  // namespace pmcd::admin
