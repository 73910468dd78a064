// SPDX-License-Identifier: MIT
#include "codec/encoder/grouping.h"

#include <algorithm>

namespace pmcd::codec {
namespace {

// A mesh of more vertices than this is worth at least so many packets after the base.
constexpr std::uint32_t kLargeMesh = 5000;
constexpr std::size_t kFewestPackets = 7;

// The n-th root of x >= 1 by bisection: no libm function decides what is in a stream.
double root(double x, unsigned n) {
  double low = 1;
  double high = x;
  for (int i = 0; i < 60; ++i) {
    const double middle = (low + high) / 2;
    double power = 1;
    for (unsigned k = 0; k < n && power <= x; ++k) power *= middle;
    (power <= x ? low : high) = middle;
  }
  return low;
}

// Groups that each grow at least as wanted, but for what is left over at the coarse end.
std::vector<std::uint32_t> group_by_growth(double base, std::span<const std::uint32_t> vertices_after,
                                           const Growth& growth, std::optional<unsigned> most_packets) {
  std::vector<std::uint32_t> groups;
  auto before = [&](std::size_t pass) { return pass == 0 ? base : static_cast<double>(vertices_after[pass - 1]); };

  // From the fine end, where the bytes are; what is left over falls to the coarse end.
  double level_end = vertices_after.back();
  std::uint32_t in_group = 0;
  for (std::size_t pass = vertices_after.size(); pass-- > 0;) {
    const bool is_last = groups.empty();
    if (in_group > 0 && !most_packets && level_end > (is_last ? growth.last_most : growth.most) * before(pass)) {
      groups.push_back(in_group);
      in_group = 0;
      level_end = vertices_after[pass];
    }
    ++in_group;
    if (level_end < (groups.empty() ? growth.last : growth.usual) * before(pass)) continue;
    groups.push_back(in_group);
    in_group = 0;
    level_end = before(pass);
  }
  if (in_group > 0) {
    const bool too_many = most_packets && groups.size() >= *most_packets;
    const double first_of_next =
        groups.empty() ? 0 : vertices_after[static_cast<std::size_t>(in_group) + groups.back() - 1];
    if (!groups.empty() && (too_many || first_of_next <= growth.most * base)) {
      groups.back() += in_group;
    } else {
      groups.push_back(in_group);
    }
  }
  std::reverse(groups.begin(), groups.end());
  return groups;
}

}  // namespace

std::vector<std::uint32_t> group_passes(std::uint32_t base_vertices, std::span<const std::uint32_t> vertices_after,
                                        std::optional<unsigned> most_packets, const Growth& growth) {
  if (vertices_after.empty()) return {};
  const double base = std::max(1u, base_vertices);
  if (most_packets) {
    const double even = root(vertices_after.back() / base, *most_packets);
    return group_by_growth(base, vertices_after, {even, even, even, even}, most_packets);
  }
  std::vector<std::uint32_t> groups = group_by_growth(base, vertices_after, growth, most_packets);
  // Too few: the coarse ones part, where a packet more costs least of what is seen.
  for (std::size_t k = 0; k < groups.size() && vertices_after.back() > kLargeMesh && groups.size() < kFewestPackets;) {
    if (groups[k] < 2) {
      ++k;
      continue;
    }
    const std::uint32_t half = groups[k] / 2;
    groups[k] -= half;
    groups.insert(groups.begin() + static_cast<std::ptrdiff_t>(k), half);
  }
  return groups;
}

}  // namespace pmcd::codec
