// SPDX-License-Identifier: MIT
// Sums over packets, so that a run of them is a difference.
#include "daemon/scheduler/mesh_profile.h"

#include <algorithm>
#include <cmath>

namespace pmcd::scheduler {
namespace {

/// Below it nobody sees a difference on any screen.
constexpr double kInvisible = 1.0 / (1 << 20);

}  // namespace

MeshProfile::MeshProfile(std::span<const Level> levels, double finest) : bytes_{0}, gain_{0} {
  const double floor = std::max(std::isfinite(finest) ? finest : 0.0, kInvisible);
  const auto known = [](const Level& level) { return level.error >= 0 && std::isfinite(level.error); };
  for (std::size_t k = 0; k < levels.size(); ++k) {
    double gain = 0;
    if (k > 0 && known(levels[k - 1]) && known(levels[k])) {
      gain = std::log2(std::max(levels[k - 1].error, floor) / std::max(levels[k].error, floor));
    } else if (k > 0) {
      const auto vertices = [](const Level& level) {
        return static_cast<double>(std::max<std::uint64_t>(level.vertices, 1));
      };
      gain = std::log2(vertices(levels[k]) / vertices(levels[k - 1]));
    }
    bytes_.push_back(bytes_.back() + levels[k].bytes);
    gain_.push_back(gain_.back() + gain);
  }
}

double MeshProfile::steepest(std::uint32_t packet, std::uint64_t remaining) const {
  double best = 0;
  for (std::size_t end = packet + 1; end < bytes_.size(); ++end) {
    const std::uint64_t bytes = remaining + bytes_[end] - bytes_[packet + 1];
    best = std::max(best, (gain_[end] - gain_[packet]) / static_cast<double>(bytes));
  }
  return best;
}

}  // namespace pmcd::scheduler
