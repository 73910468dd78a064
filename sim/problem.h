// SPDX-License-Identifier: MIT
// What is wrong with what the user gave, as a value. It prints nothing and ends nothing.
#pragma once

#include <string>
#include <utility>
#include <variant>

namespace pmcd::sim {

/// One sentence that names the file, field or argument and its value.
struct Problem {
  std::string text;
  bool is_usage = false;  ///< the command line is wrong, by itself or beside a file; else the file is
};

inline Problem wrong_usage(std::string text) {
  return {std::move(text), true};
}

template <typename T>
using Result = std::variant<T, Problem>;

template <typename T>
[[nodiscard]] const Problem* problem_of(const Result<T>& result) {
  return std::get_if<Problem>(&result);
}

}  // namespace pmcd::sim
