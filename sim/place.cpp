// SPDX-License-Identifier: MIT
// Ways are written as in JavaScript.
#include "sim/place.h"

#include <nlohmann/json.hpp>

namespace pmcd::sim {

using nlohmann::json;

Place Place::at(std::string_view field) const {
  Place place(*this);
  place.way_.append(way_.empty() ? "" : ".").append(field);
  return place;
}

Place Place::at(std::size_t entry) const {
  Place place(*this);
  place.way_ += "[" + std::to_string(entry) + "]";
  return place;
}

Problem Place::problem(const std::string& what) const {
  return {file_ + ": " + way_ + (way_.empty() ? "" : " ") + what};
}

std::string shown(const json& value) {
  const std::string text = value.dump(-1, ' ', false, json::error_handler_t::replace);
  return text.size() <= 40 ? text : text.substr(0, 37) + "...";
}

}  // namespace pmcd::sim
