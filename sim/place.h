// SPDX-License-Identifier: MIT
// Where in a JSON file something stands, and how that is said to the one who wrote it. It opens no file.
#pragma once

#include <cstddef>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>
#include <utility>

#include "sim/problem.h"

namespace pmcd::sim {

/// A value in a file, by the way from the file's outermost value, which is the place that is made first.
class Place {
 public:
  explicit Place(std::string file) : file_(std::move(file)) {}

  [[nodiscard]] Place at(std::string_view field) const;
  [[nodiscard]] Place at(std::size_t entry) const;
  /// "FILE: lines[0].name WHAT"
  [[nodiscard]] Problem problem(const std::string& what) const;

 private:
  std::string file_;
  std::string way_;
};

/// A value as it stands in errors: JSON of at most 40 characters.
std::string shown(const nlohmann::json& value);

}  // namespace pmcd::sim
