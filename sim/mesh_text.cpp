// SPDX-License-Identifier: MIT
// Reads meshes from JSON and from tables; each error names the place or line, the field and the value.
#include "sim/mesh_text.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

namespace pmcd::sim {
namespace {

using nlohmann::json;
using Level = scheduler::MeshProfile::Level;

/// More is no packet of ours, and sums of less stay exact.
constexpr std::uint64_t kMostBytes = std::uint64_t{1} << 40;
constexpr std::uint64_t kMostPackets = 100'000;

Result<std::uint64_t> count_field(const json& object, const char* name, std::uint64_t least, std::uint64_t most,
                                  const Place& place) {
  const auto found = object.find(name);
  if (found == object.end()) return place.problem(std::string("has no \"") + name + "\"");
  if (!found->is_number_unsigned() || found->get<std::uint64_t>() < least || found->get<std::uint64_t>() > most) {
    return place.at(name).problem("is " + shown(*found) + ", not a whole number from " + std::to_string(least) +
                                  " to " + std::to_string(most));
  }
  return found->get<std::uint64_t>();
}

/// Half a step of the lattice, relative to the diagonal of the box; 0 where the document does not say, and of a mesh
/// that comes back exactly as it was.
double finest_of(const json& mesh) {
  if (const auto lossless = mesh.find("lossless"); lossless != mesh.end() && *lossless == true) return 0;
  const auto bits = mesh.find("bits");
  const auto low = mesh.find("box_min");
  const auto high = mesh.find("box_max");
  if (bits == mesh.end() || !bits->is_number_unsigned() || low == mesh.end() || high == mesh.end()) return 0;
  if (!low->is_array() || !high->is_array() || low->size() != 3 || high->size() != 3) return 0;
  double squares = 0;
  double longest = 0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (!(*low)[axis].is_number() || !(*high)[axis].is_number()) return 0;
    const double side = (*high)[axis].get<double>() - (*low)[axis].get<double>();
    squares += side * side;
    longest = std::max(longest, side);
  }
  if (!(squares > 0)) return 0;
  return 0.5 * longest / (std::exp2(static_cast<double>(bits->get<std::uint64_t>())) - 1) / std::sqrt(squares);
}

Result<Mesh> mesh_of(const json& document, const Place& place) {
  if (!document.is_object()) return place.problem("is " + shown(document) + ", not a mesh");
  const auto name = document.find("name");
  if (name == document.end()) return place.problem("has no \"name\"");
  if (!name->is_string()) return place.at("name").problem("is " + shown(*name) + ", not a name");
  const auto levels = document.find("levels");
  if (levels == document.end()) {
    std::uint64_t totals[3] = {};
    const char* const fields[3] = {"vertices", "bytes", "packets"};
    const std::uint64_t most[3] = {kMostBytes, kMostBytes, kMostPackets};
    for (int i = 0; i < 3; ++i) {
      auto total = count_field(document, fields[i], 1, most[i], place);
      if (const Problem* problem = problem_of(total)) return *problem;
      totals[i] = std::get<std::uint64_t>(total);
    }
    return model_mesh(name->get<std::string>(), totals[0], totals[1], static_cast<std::uint32_t>(totals[2]));
  }
  if (!levels->is_array() || levels->empty() || levels->size() > kMostPackets) {
    return place.at("levels").problem("is " + shown(*levels) + ", not an array of 1 to " +
                                      std::to_string(kMostPackets) + " levels");
  }
  std::vector<Level> read;
  for (const json& entry : *levels) {
    const Place level = place.at("levels").at(read.size());
    if (!entry.is_object()) return level.problem("is " + shown(entry) + ", not an object");
    auto bytes = count_field(entry, "bytes", 1, kMostBytes, level);
    if (const Problem* problem = problem_of(bytes)) return *problem;
    auto vertices = count_field(entry, "vertices", 0, kMostBytes, level);
    if (const Problem* problem = problem_of(vertices)) return *problem;
    const auto error = entry.find("error_rms");
    const bool measured = error != entry.end() && !error->is_null();
    if (measured && (!error->is_number() || error->get<double>() < 0)) {
      return level.at("error_rms").problem("is " + shown(*error) + ", not null or a number from 0 on");
    }
    read.push_back(
        {std::get<std::uint64_t>(bytes), std::get<std::uint64_t>(vertices), measured ? error->get<double>() : -1});
  }
  return make_mesh(name->get<std::string>(), std::move(read), finest_of(document));
}

std::vector<std::string_view> cells_of(std::string_view line) {
  std::vector<std::string_view> cells;
  while (true) {
    const auto comma = line.find(',');
    cells.push_back(line.substr(0, comma));
    if (comma == std::string_view::npos) return cells;
    line.remove_prefix(comma + 1);
  }
}

template <typename Number>
std::optional<Number> number_of(std::string_view text) {
  Number value{};
  const auto [stop, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || stop != text.data() + text.size()) return std::nullopt;
  return value;
}

struct Row {
  std::string_view name;
  Level level;
};

/// `level`: the number that must stand there.
Result<Row> row_of(std::string_view line, const std::string& here, std::uint64_t level) {
  const auto cells = cells_of(line);
  if (cells.size() != 5) {
    return Problem{here + ": has " + std::to_string(cells.size()) + " fields, not 5 (name,level,bytes,vertices,error)"};
  }
  const auto wrong = [&](const char* field, std::string_view value, const std::string& what) {
    return Problem{here + ": " + field + " is \"" + std::string(value) + "\", not " + what};
  };
  const auto number = number_of<std::uint64_t>(cells[1]);
  if (number != level) return wrong("level", cells[1], std::to_string(level));
  const auto bytes = number_of<std::uint64_t>(cells[2]);
  if (!bytes || *bytes == 0 || *bytes > kMostBytes) return wrong("bytes", cells[2], "a whole number from 1 on");
  const auto vertices = number_of<std::uint64_t>(cells[3]);
  if (!vertices) return wrong("vertices", cells[3], "a whole number");
  double error = -1;
  if (!cells[4].empty()) {
    const auto given = number_of<double>(cells[4]);
    if (!given || !(*given >= 0) || !std::isfinite(*given))
      return wrong("error", cells[4], "empty or a number from 0 on");
    error = *given;
  }
  return Row{cells[0], {*bytes, *vertices, error}};
}

}  // namespace

Result<std::vector<Mesh>> meshes_of(const json& rows, const Place& place) {
  std::vector<Mesh> meshes;
  for (const json& row : rows) {
    auto mesh = mesh_of(row, place.at(meshes.size()));
    if (const Problem* problem = problem_of(mesh)) return *problem;
    meshes.push_back(std::get<Mesh>(std::move(mesh)));
  }
  return meshes;
}

Result<std::vector<Mesh>> parse_mesh_documents(std::string_view text, const std::string& from) {
  const Place file(from);
  const json document = json::parse(text.begin(), text.end(), nullptr, false);
  if (document.is_discarded()) return file.problem("is no JSON");
  const bool is_list = document.is_object() && document.contains("meshes");
  const json& all = is_list ? document.at("meshes") : document;
  const Place place = is_list ? file.at("meshes") : file;
  if (!all.is_array()) {
    auto mesh = mesh_of(all, place);
    if (const Problem* problem = problem_of(mesh)) return *problem;
    return std::vector{std::get<Mesh>(std::move(mesh))};
  }
  if (all.empty()) return file.problem("holds no mesh");
  return meshes_of(all, place);
}

Result<std::vector<Mesh>> parse_mesh_table(std::string_view text, const std::string& from) {
  std::vector<Mesh> meshes;
  std::string name;
  std::vector<Level> levels;
  const auto close = [&] {
    if (!levels.empty()) meshes.push_back(make_mesh(name, std::exchange(levels, {}), 0));
  };
  for (std::size_t number = 1; !text.empty(); ++number) {
    std::string_view line = text.substr(0, text.find('\n'));
    text.remove_prefix(std::min(line.size() + 1, text.size()));
    if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
    const std::string here = from + ": line " + std::to_string(number);
    if (number == 1) {
      if (line != "name,level,bytes,vertices,error") {
        return Problem{here + ": is neither JSON nor the header name,level,bytes,vertices,error"};
      }
      continue;
    }
    if (line.empty()) continue;
    const bool goes_on = !levels.empty() && line.substr(0, line.find(',')) == name;
    auto row = row_of(line, here, goes_on ? levels.size() : 0);
    if (const Problem* problem = problem_of(row)) return *problem;
    if (!goes_on) {
      close();
      name = std::get<Row>(row).name;
    }
    levels.push_back(std::get<Row>(row).level);
  }
  close();
  if (meshes.empty()) return Problem{from + ": holds no mesh"};
  return meshes;
}

}  // namespace pmcd::sim
