// SPDX-License-Identifier: MIT
// Meshes from levels, and levels from totals.
#include "sim/meshes.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>
#include <utility>

#include "sim/mesh_text.h"

namespace pmcd::sim {
namespace {

using Level = scheduler::MeshProfile::Level;

/// Measured on meshes of 10,000 to 50,000 vertices: the error of a base mesh of some 60 vertices, how it falls with
/// the vertices, and how much less than its share of bytes a vertex of a coarse level costs.
constexpr double kBaseError = 0.03;
constexpr double kErrorPower = 0.8;
constexpr double kLastError = 1e-5;
constexpr double kCoarsestVertices = 60;

double error_of(const std::vector<Level>& levels, std::size_t k) {
  if (levels[k].error >= 0) return levels[k].error;
  // The same guess as MeshProfile's: the distance falls with the area of the triangles.
  const double vertices = static_cast<double>(std::max<std::uint64_t>(levels[k].vertices, 1));
  const double first = static_cast<double>(std::max<std::uint64_t>(levels[0].vertices, 1));
  return (levels[0].error >= 0 ? levels[0].error : 1.0) * first / vertices;
}

}  // namespace

Mesh make_mesh(std::string name, std::vector<Level> levels, double finest) {
  Mesh mesh;
  mesh.name = std::move(name);
  mesh.levels = std::move(levels);
  mesh.profile = std::make_shared<const scheduler::MeshProfile>(mesh.levels, finest);
  for (const Level& level : mesh.levels) mesh.bytes += level.bytes;
  for (std::size_t part = 0; part < kErrorParts.size(); ++part) {
    std::size_t k = 0;
    while (k + 1 < mesh.levels.size() && error_of(mesh.levels, k) > kErrorParts[part] * error_of(mesh.levels, 0)) ++k;
    mesh.level_at[part] = static_cast<std::uint32_t>(k);
  }
  return mesh;
}

Mesh model_mesh(std::string name, std::uint64_t vertices, std::uint64_t bytes, std::uint32_t packets) {
  const double all = static_cast<double>(vertices);
  std::vector<double> at(packets, all);
  std::vector<double> weight(packets, 0);
  double sum = 0;
  const double first = std::min(all, kCoarsestVertices);
  const double growth = packets > 1 ? std::pow(all / first, 1.0 / (packets - 1)) : 1.0;
  for (std::uint32_t k = 0; k < packets; ++k) {
    if (k + 1 < packets) at[k] = k == 0 ? first : at[k - 1] * growth;
    const double added = k == 0 ? at[0] : std::max(0.0, at[k] - at[k - 1]);
    // Coordinates of the fine levels have more digits that nothing foretells.
    weight[k] = (added + 10) * (k == 0 ? 1.5 : 1.0 + static_cast<double>(k) / packets);
    sum += weight[k];
  }
  std::vector<Level> levels;
  for (std::uint32_t k = 0; k < packets; ++k) {
    const auto share = static_cast<std::uint64_t>(static_cast<double>(bytes) * weight[k] / sum);
    const double error = k + 1 == packets ? kLastError : kBaseError * std::pow(at[k] / first, -kErrorPower);
    levels.push_back({std::max<std::uint64_t>(share, 1), static_cast<std::uint64_t>(at[k]), error});
  }
  return make_mesh(std::move(name), std::move(levels), kLastError);
}

std::vector<Mesh> built_in_meshes() {
  return {model_mesh("horse", 48'500, 150'000, 11), model_mesh("bunny", 35'900, 132'000, 10),
          model_mesh("hand", 27'500, 88'000, 10),   model_mesh("rocker", 10'000, 28'000, 8),
          model_mesh("bust", 34'800, 115'000, 10),  model_mesh("warrior", 72'500, 240'000, 11),
          model_mesh("vase", 14'800, 44'000, 9),    model_mesh("teapot", 6'300, 17'500, 8),
          model_mesh("bone", 20'100, 61'000, 9),    model_mesh("bracket", 3'100, 9'300, 7)};
}

Result<std::vector<Mesh>> parse_meshes(std::string_view text, const std::string& from) {
  const auto first = text.find_first_not_of(" \t\r\n");
  if (first == std::string_view::npos) return Problem{from + ": there is nothing in it"};
  return text[first] == '{' || text[first] == '[' ? parse_mesh_documents(text, from) : parse_mesh_table(text, from);
}

Result<std::vector<Mesh>> read_meshes(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) return Problem{path + ": cannot be opened"};
  const std::string text{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
  if (file.bad()) return Problem{path + ": cannot be read"};
  return parse_meshes(text, path);
}

}  // namespace pmcd::sim
