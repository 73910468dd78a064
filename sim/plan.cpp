// SPDX-License-Identifier: MIT
// Each error names the place in the file, and the value that stands there.
#include "sim/plan.h"

#include <algorithm>
#include <array>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <span>
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

constexpr auto kPlanFields =
    std::to_array<std::string_view>({"uplink_kbit", "uplink_queue_bytes", "open", "lines", "clients", "meshes"});
constexpr auto kLineFields = std::to_array<std::string_view>({"name", "down_kbit", "up_kbit", "rtt_ms", "queue_bytes"});
constexpr auto kClientFields = std::to_array<std::string_view>(
    {"arrives", "line", "mesh", "meshes", "stalls_after", "leaves_after", "joins_after"});
/// All that pmcctl and bench/rules/run write of a mesh and of a level: most of it means nothing to a simulation.
constexpr auto kMeshFields = std::to_array<std::string_view>(
    {"name", "levels", "generation", "vertices", "faces", "packets", "bytes", "lossless", "bits", "scalar",
     "format_version", "box_min", "box_max", "ingested_at", "file"});
constexpr auto kLevelFields = std::to_array<std::string_view>(
    {"level", "bytes", "vertices", "faces", "bits", "error_rms", "error_max", "crc32c"});

/// A Problem on its way to parse_plan(); thrown and caught in this file only.
struct Wrong {
  Problem problem;
};

[[noreturn]] void wrong_at(const Place& place, const std::string& what) {
  throw Wrong{place.problem(what)};
}

/// An object that has no fields but `known` ones.
const json& object_of(const json& value, std::span<const std::string_view> known, const Place& place) {
  if (!value.is_object()) wrong_at(place, "is " + shown(value) + ", not an object");
  for (const auto& field : value.items()) {
    if (std::find(known.begin(), known.end(), field.key()) == known.end()) {
      wrong_at(place, "has a " + shown(field.key()) + ", which means nothing here");
    }
  }
  return value;
}

/// A null says nothing.
bool says(const json& object, const char* field) {
  const auto found = object.find(field);
  return found != object.end() && !found->is_null();
}

const json& field_of(const json& object, const char* field, const Place& place) {
  const auto found = object.find(field);
  if (found == object.end()) wrong_at(place, std::string("has no \"") + field + "\"");
  return *found;
}

/// A number of an object, or `otherwise` where it has none.
double number_field(const json& object, const char* field, double least, double most, const Place& place,
                    std::optional<double> otherwise = std::nullopt) {
  if (otherwise && !says(object, field)) return *otherwise;
  const json& found = field_of(object, field, place);
  const double value = found.is_number() ? found.get<double>() : least - 1;
  if (!(value >= least && value <= most)) {
    wrong_at(place.at(field),
             "is " + shown(found) + ", not a number from " + shown(json(least)) + " to " + shown(json(most)));
  }
  return value;
}

std::optional<std::uint32_t> packet_field(const json& object, const char* field, const Place& place) {
  const double value = number_field(object, field, 0, kMostLevel, place, -1);
  if (value < 0) return std::nullopt;
  return static_cast<std::uint32_t>(value);
}

const json& array_field(const json& object, const char* field, const Place& place) {
  const json& found = field_of(object, field, place);
  if (!found.is_array() || found.empty()) {
    wrong_at(place.at(field), "is " + shown(found) + ", not an array with something in it");
  }
  return found;
}

std::string name_of(const json& value, const Place& place) {
  if (!value.is_string()) wrong_at(place, "is " + shown(value) + ", not a name");
  return value.get<std::string>();
}

/// Where the one with that name stands; `what` they are, all together.
template <typename Named>
std::uint32_t index_of(const std::vector<Named>& all, const json& name, const char* what, const Place& place) {
  const std::string wanted = name_of(name, place);
  const auto found = std::find_if(all.begin(), all.end(), [&wanted](const Named& one) { return one.name == wanted; });
  if (found == all.end()) wrong_at(place, "is " + shown(name) + ", none of the " + what + " that there are");
  return static_cast<std::uint32_t>(found - all.begin());
}

Line line_of(const json& value, const Place& place) {
  const json& object = object_of(value, kLineFields, place);
  Line line;
  line.name = name_of(field_of(object, "name", place), place.at("name"));
  line.down_kbit = number_field(object, "down_kbit", 0.1, kMostKbit, place);
  line.up_kbit = number_field(object, "up_kbit", 0.1, kMostKbit, place);
  line.round_trip = number_field(object, "rtt_ms", 0, 60'000, place) / 1000;
  line.queue_bytes = number_field(object, "queue_bytes", 1500, kMostQueue, place, 0);
  return line;
}

ClientPlan client_of(const json& value, const Scenario& scenario, const Place& place) {
  const json& object = object_of(value, kClientFields, place);
  ClientPlan client;
  client.arrives = number_field(object, "arrives", 0, kMostSeconds, place, 0);
  client.line = index_of(scenario.lines, field_of(object, "line", place), "lines", place.at("line"));
  if (object.contains("mesh")) {
    if (object.contains("meshes")) wrong_at(place, "has a \"mesh\" and \"meshes\": only one of them can count");
    client.meshes.push_back(index_of(scenario.meshes, object.at("mesh"), "meshes", place.at("mesh")));
  } else {
    for (const json& mesh : array_field(object, "meshes", place)) {
      client.meshes.push_back(index_of(scenario.meshes, mesh, "meshes", place.at("meshes").at(client.meshes.size())));
    }
  }
  client.stalls_after = packet_field(object, "stalls_after", place);
  client.leaves_after = packet_field(object, "leaves_after", place);
  const double joins = number_field(object, "joins_after", 0, kMostSeconds, place, -1);
  if (joins >= 0) client.joins_after = joins;
  return client;
}

std::vector<Mesh> meshes_field(const json& plan, const Place& root) {
  const json& rows = array_field(plan, "meshes", root);
  const Place place = root.at("meshes");
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const json& mesh = object_of(rows[i], kMeshFields, place.at(i));
    const auto levels = mesh.find("levels");
    if (levels == mesh.end() || !levels->is_array()) continue;
    for (std::size_t k = 0; k < levels->size(); ++k) {
      object_of((*levels)[k], kLevelFields, place.at(i).at("levels").at(k));
    }
  }
  auto meshes = meshes_of(rows, place);
  if (const Problem* problem = problem_of(meshes)) throw Wrong{*problem};
  return std::get<std::vector<Mesh>>(std::move(meshes));
}

}  // namespace

Result<Scenario> parse_plan(std::string_view text, const std::string& from, Scenario scenario,
                            std::span<const PlanOption> given) {
  const Place root(from);
  const json document = json::parse(text.begin(), text.end(), nullptr, false);
  if (document.is_discarded()) return root.problem("is no JSON");
  try {
    const json& plan = object_of(document, kPlanFields, root);
    for (const auto& [option, field] : given) {
      if (!says(plan, field)) continue;
      return wrong_usage(
          root.problem(std::string("has a \"") + field + "\", so " + option + " cannot count: leave one of them out")
              .text);
    }
    scenario.uplink_kbit = number_field(plan, "uplink_kbit", 0.1, kMostKbit, root, scenario.uplink_kbit);
    scenario.uplink_queue_bytes = number_field(plan, "uplink_queue_bytes", 1500, kMostQueue, root, 0);
    scenario.open = static_cast<unsigned>(number_field(plan, "open", 1, kMostOpen, root, scenario.open));
    if (plan.contains("meshes")) scenario.meshes = meshes_field(plan, root);
    scenario.lines.clear();
    for (const json& line : array_field(plan, "lines", root)) {
      scenario.lines.push_back(line_of(line, root.at("lines").at(scenario.lines.size())));
    }
    scenario.clients.clear();
    for (const json& client : array_field(plan, "clients", root)) {
      scenario.clients.push_back(client_of(client, scenario, root.at("clients").at(scenario.clients.size())));
    }
  } catch (const Wrong& wrong) {
    return wrong.problem;
  }
  return scenario;
}

Result<Scenario> read_plan(const std::string& path, Scenario scenario, std::span<const PlanOption> given) {
  std::ifstream file(path, std::ios::binary);
  if (!file) return Problem{path + ": cannot be opened"};
  const std::string text{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
  if (file.bad()) return Problem{path + ": cannot be read"};
  return parse_plan(text, path, std::move(scenario), given);
}

}  // namespace pmcd::sim
