// SPDX-License-Identifier: MIT
#include "codec/lattice/ordered_float.h"

namespace pmcd::codec {
namespace {

constexpr std::uint64_t kLongestStep = std::uint64_t{1} << 61;

// The smallest ordered integer of `bounds` that snaps to `index` or above; bounds.last + 1 if none. Snapping never
// falls when the coordinate grows, so a guess, doubling steps and a bisection find it.
std::int64_t first_from(const Lattice& lattice, int axis, std::int32_t index, const OrderedRange& bounds) {
  if (index <= 0) return bounds.first;
  auto reaches = [&](std::int64_t ordered) {
    return lattice.snap(from_ordered(ordered, lattice.scalar), axis) >= index;
  };
  double edge = lattice.min[static_cast<std::size_t>(axis)] + (index - 0.5) * lattice.step;
  if (lattice.scalar == Scalar::float32) edge = static_cast<double>(static_cast<float>(edge));
  std::int64_t guess = to_ordered(edge, lattice.scalar);
  if (guess < bounds.first) guess = bounds.first;
  if (guess > bounds.last) guess = bounds.last;

  // The answer lies in (below, above]. Distances are unsigned: all floats together are more than int64 can count.
  auto distance = [](std::int64_t from, std::int64_t to) {
    return static_cast<std::uint64_t>(to) - static_cast<std::uint64_t>(from);
  };
  std::int64_t below = bounds.first - 1;
  std::int64_t above = bounds.last + 1;
  if (reaches(guess)) {
    above = guess;
    for (std::uint64_t step = 1; step <= kLongestStep && distance(bounds.first, above) >= step; step *= 2) {
      const std::int64_t probe = above - static_cast<std::int64_t>(step);
      if (!reaches(probe)) {
        below = probe;
        break;
      }
      above = probe;
    }
  } else {
    below = guess;
    for (std::uint64_t step = 1; step <= kLongestStep && distance(below, bounds.last) >= step; step *= 2) {
      const std::int64_t probe = below + static_cast<std::int64_t>(step);
      if (reaches(probe)) {
        above = probe;
        break;
      }
      below = probe;
    }
  }
  while (distance(below, above) > 1) {
    const std::int64_t middle = below + static_cast<std::int64_t>(distance(below, above) / 2);
    (reaches(middle) ? above : below) = middle;
  }
  return above;
}

}  // namespace

OrderedRange floats_in_cell(const Lattice& lattice, int axis, std::int32_t index, const OrderedRange& bounds) {
  OrderedRange range;
  range.first = first_from(lattice, axis, index, bounds);
  range.last = index >= lattice.max_index() ? bounds.last : first_from(lattice, axis, index + 1, bounds) - 1;
  return range;
}

}  // namespace pmcd::codec
