// SPDX-License-Identifier: MIT
// The meshes that clients fetch, as what each packet costs and brings. Read from what pmcctl prints or from a table, or
// made up. No packet is opened here.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/scheduler/mesh_profile.h"
#include "sim/problem.h"

namespace pmcd::sim {

/// Parts of the first level's error at which a viewer's eye is asked.
inline constexpr std::array<double, 3> kErrorParts = {0.10, 0.05, 0.01};

struct Mesh {
  std::string name;
  std::vector<scheduler::MeshProfile::Level> levels;  ///< at least one, each of at least one byte
  std::shared_ptr<const scheduler::MeshProfile> profile;
  std::uint64_t bytes = 0;  ///< of all packets
  /// The first level whose error is at most that part of the first level's, for each of kErrorParts; levels whose error
  /// was not measured are taken to be as much better as they have more vertices. At most the last level.
  std::array<std::uint32_t, kErrorParts.size()> level_at{};
};

/// `finest`: as MeshProfile takes it. REQUIRES: as Mesh::levels.
Mesh make_mesh(std::string name, std::vector<scheduler::MeshProfile::Level> levels, double finest);

/// A mesh of which only totals are known, with levels as the codec makes them: about twice the vertices from one to the
/// next, bytes as vertices are added, the last at a lossless coordinate's cost. REQUIRES: packets, vertices, bytes > 0.
Mesh model_mesh(std::string name, std::uint64_t vertices, std::uint64_t bytes, std::uint32_t packets);

/// Ten meshes from 9 kB to 240 kB.
std::vector<Mesh> built_in_meshes();

/// A text of any of these forms: what `pmcctl show NAME --json` prints, an array of those, what `pmcctl list --json`
/// prints (levels are modelled from totals), a table with the header "name,level,bytes,vertices,error" (error relative
/// to the diagonal, may be empty). `from` names it in errors.
Result<std::vector<Mesh>> parse_meshes(std::string_view text, const std::string& from);
/// The same of a file.
Result<std::vector<Mesh>> read_meshes(const std::string& path);

}  // namespace pmcd::sim
