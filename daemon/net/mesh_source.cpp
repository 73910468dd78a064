// SPDX-License-Identifier: MIT
// From a level directory to what a rule weighs.
#include "daemon/net/mesh_source.h"

#include <cmath>
#include <vector>

namespace pmcd::net {

std::shared_ptr<const scheduler::MeshProfile> make_profile(const store::Mesh& mesh) {
  std::vector<scheduler::MeshProfile::Level> levels;
  levels.reserve(mesh.levels.size());
  for (const codec::LevelEntry& entry : mesh.levels) levels.push_back({entry.bytes, entry.vertices, entry.error_rms});
  const auto& [min, max] = std::pair(mesh.summary.box_min, mesh.summary.box_max);
  const double diagonal = std::hypot(max[0] - min[0], max[1] - min[1], max[2] - min[2]);
  const double half_step = mesh.summary.lossless ? 0 : mesh.summary.lattice.step / 2;
  return std::make_shared<const scheduler::MeshProfile>(levels, diagonal > 0 ? half_step / diagonal : 0);
}

}  // namespace pmcd::net
