// SPDX-License-Identifier: MIT
// Each error names the client or line, the field and the value.
#include "sim/plan.h"

#include <algorithm>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <utility>

#include "sim/mesh_text.h"

namespace pmcd::sim {
namespace {

using nlohmann::json;

constexpr double kMostKbit = 1e9;
constexpr double kMostSeconds = 1e9;
constexpr double kMostQueue = 1e12;
constexpr double kMostOpen = 8;
constexpr double kMostLevel = 1e5;

/// What is wrong, for the one who reads; thrown and caught in this file only.
struct Wrong {
  std::string text;
};

std::string shown(const json& value) {
  const std::string text = value.dump(-1, ' ', false, json::error_handler_t::replace);
  return text.size() <= 40 ? text : text.substr(0, 37) + "...";
}

/// A number of an object, or `otherwise` where it has none or null.
double number_field(const json& object, const char* field, double least, double most, const std::string& where,
                    std::optional<double> otherwise = std::nullopt) {
  const auto found = object.find(field);
  if (found == object.end() || found->is_null()) {
    if (otherwise) return *otherwise;
    throw Wrong{where + ": has no \"" + field + "\""};
  }
  const double value = found->is_number() ? found->get<double>() : least - 1;
  if (!(value >= least && value <= most)) {
    throw Wrong{where + ": \"" + field + "\" is " + shown(*found) + ", not a number from " + shown(json(least)) +
                " to " + shown(json(most))};
  }
  return value;
}

std::optional<std::uint32_t> packet_field(const json& object, const char* field, const std::string& where) {
  const double value = number_field(object, field, 0, kMostLevel, where, -1);
  if (value < 0) return std::nullopt;
  return static_cast<std::uint32_t>(value);
}

const json& array_field(const json& object, const char* field, const std::string& where) {
  const auto found = object.find(field);
  if (found == object.end() || !found->is_array() || found->empty()) {
    throw Wrong{where + ": \"" + field + "\" is no array with something in it"};
  }
  return *found;
}

std::string name_of(const json& value, const std::string& where) {
  if (!value.is_string()) throw Wrong{where + ": " + shown(value) + " is no name"};
  return value.get<std::string>();
}

/// Where the one with that name stands.
template <typename Named>
std::uint32_t index_of(const std::vector<Named>& all, const std::string& name, const std::string& what) {
  const auto found = std::find_if(all.begin(), all.end(), [&name](const Named& one) { return one.name == name; });
  if (found == all.end()) throw Wrong{what + " \"" + name + "\" is none of those that there are"};
  return static_cast<std::uint32_t>(found - all.begin());
}

const json& object_of(const json& value, const std::string& where) {
  if (!value.is_object()) throw Wrong{where + ": is " + shown(value) + ", not an object"};
  return value;
}

Line line_of(const json& value, const std::string& where) {
  const json& object = object_of(value, where);
  Line line;
  line.name = name_of(object.value("name", json()), where + ": \"name\"");
  line.down_kbit = number_field(object, "down_kbit", 0.1, kMostKbit, where);
  line.up_kbit = number_field(object, "up_kbit", 0.1, kMostKbit, where);
  line.round_trip = number_field(object, "rtt_ms", 0, 60'000, where) / 1000;
  line.queue_bytes = number_field(object, "queue_bytes", 1500, kMostQueue, where, 0);
  return line;
}

ClientPlan client_of(const json& value, const Scenario& scenario, const std::string& where) {
  const json& object = object_of(value, where);
  ClientPlan client;
  client.arrives = number_field(object, "arrives", 0, kMostSeconds, where, 0);
  client.line = index_of(scenario.lines, name_of(object.value("line", json()), where + ": \"line\""), where + ": line");
  const json meshes = object.contains("mesh") ? json::array({object["mesh"]}) : array_field(object, "meshes", where);
  for (const json& mesh : meshes) {
    client.meshes.push_back(index_of(scenario.meshes, name_of(mesh, where + ": mesh"), where + ": mesh"));
  }
  client.stalls_after = packet_field(object, "stalls_after", where);
  client.leaves_after = packet_field(object, "leaves_after", where);
  const double joins = number_field(object, "joins_after", 0, kMostSeconds, where, -1);
  if (joins >= 0) client.joins_after = joins;
  return client;
}

}  // namespace

Result<Scenario> parse_plan(std::string_view text, const std::string& from, Scenario scenario) {
  const json document = json::parse(text.begin(), text.end(), nullptr, false);
  if (document.is_discarded()) return Problem{from + ": is no JSON"};
  try {
    const json& plan = object_of(document, from);
    scenario.uplink_kbit = number_field(plan, "uplink_kbit", 0.1, kMostKbit, from, scenario.uplink_kbit);
    scenario.uplink_queue_bytes = number_field(plan, "uplink_queue_bytes", 1500, kMostQueue, from, 0);
    scenario.open = static_cast<unsigned>(number_field(plan, "open", 1, kMostOpen, from, scenario.open));
    if (plan.contains("meshes")) {
      auto meshes = parse_mesh_documents(array_field(plan, "meshes", from).dump(), from);
      if (const Problem* problem = problem_of(meshes)) return *problem;
      scenario.meshes = std::get<std::vector<Mesh>>(std::move(meshes));
    }
    scenario.lines.clear();
    for (const json& line : array_field(plan, "lines", from)) {
      scenario.lines.push_back(line_of(line, from + ": line " + std::to_string(scenario.lines.size() + 1)));
    }
    scenario.clients.clear();
    for (const json& client : array_field(plan, "clients", from)) {
      scenario.clients.push_back(
          client_of(client, scenario, from + ": client " + std::to_string(scenario.clients.size() + 1)));
    }
  } catch (const Wrong& wrong) {
    return Problem{wrong.text};
  }
  return scenario;
}

Result<Scenario> read_plan(const std::string& path, Scenario scenario) {
  std::ifstream file(path, std::ios::binary);
  if (!file) return Problem{path + ": cannot be opened"};
  const std::string text{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
  if (file.bad()) return Problem{path + ": cannot be read"};
  return parse_plan(text, path, std::move(scenario));
}

}  // namespace pmcd::sim
