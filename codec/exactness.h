// SPDX-License-Identifier: MIT
// What lifts lattice positions to the original coordinates, the last thing in the last packet of a lossless mesh. Both
// directions in one text, as in refine.h. Nothing below the lattice is predictable on scans, so numbers within a cell
// are coded as equally likely; what can be known is that files hold decimals, that coordinates come again (planes,
// voxel grids), and that a translation leaves decimals a few floats off.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <optional>
#include <vector>

#include "codec/entropy/adaptive_bit.h"
#include "codec/lattice/cell.h"
#include "codec/lattice/exactness_form.h"
#include "codec/level_state.h"
#include "codec/result.h"
#include "codec/source.h"

namespace pmcd::codec {

/// 64-bit numbers, all equally likely: the leading bits as one uniform number, the rest raw.
template <typename Source>
std::uint64_t code_uniform64(Source& source, std::uint64_t value, std::uint64_t count) {
  constexpr unsigned kLeading = 23;
  if (count <= 1) return 0;
  const auto width = static_cast<unsigned>(std::bit_width(count - 1));
  const unsigned low = width > kLeading ? width - kLeading : 0;
  const auto leading_count = static_cast<std::uint32_t>(((count - 1) >> low) + 1);
  std::uint64_t result = source.uniform(static_cast<std::uint32_t>(value >> low), leading_count);
  for (unsigned left = low; left > 0;) {
    const unsigned bits = std::min(left, 32u);
    left -= bits;
    const auto part = static_cast<std::uint32_t>((value >> left) & (~std::uint64_t{0} >> (64 - bits)));
    result = (result << bits) | source.raw(part, bits);
  }
  return result;
}

/// How many floats a coordinate lies off: mostly none, else mostly few. Any number, modulo 2^64.
class StrayModel {
 public:
  template <typename Source>
  std::int64_t code(Source& source, std::int64_t value) {
    if (!source.bit(nonzero_, value != 0)) return 0;
    const bool negative = source.bit(negative_, value < 0);
    const std::uint64_t magnitude =
        negative ? 0 - static_cast<std::uint64_t>(value) : static_cast<std::uint64_t>(value);
    unsigned length = 0;  // of magnitude, without its leading one
    while (length < kMaxLength && source.bit(longer_[length], (magnitude >> length) > 1)) ++length;
    std::uint64_t result = 1;
    for (unsigned left = length; left > 0;) {
      const unsigned bits = std::min(left, 32u);
      left -= bits;
      result =
          (result << bits) | source.raw(static_cast<std::uint32_t>((magnitude >> left) & ((1ull << bits) - 1)), bits);
    }
    return static_cast<std::int64_t>(negative ? 0 - result : result);
  }

 private:
  static constexpr unsigned kMaxLength = 63;
  AdaptiveBit nonzero_;
  AdaptiveBit negative_;
  std::array<AdaptiveBit, kMaxLength> longer_;
};

/// The value that came most of late in each cell of one axis. A table as large as the vertices are many, and no larger
/// than the lattice: a cell's entry may be taken by another cell.
class Repeats {
 public:
  static constexpr std::size_t kScores = 8;
  struct Entry {
    double value = 0;
    std::int32_t index = -1;
    std::uint8_t score = 0;  ///< how sure, below kScores
  };

  Repeats(std::size_t vertices, const Lattice& lattice)
      : entries_(std::bit_ceil(std::clamp<std::size_t>(vertices, 1, static_cast<std::size_t>(lattice.max_index())))) {}

  [[nodiscard]] const Entry& at(std::int32_t index) const { return entries_[slot(index)]; }
  void learn(std::int32_t index, double value) {
    Entry& entry = entries_[slot(index)];
    const bool known = entry.index == index;
    if (known && std::bit_cast<std::uint64_t>(entry.value) == std::bit_cast<std::uint64_t>(value)) {
      if (entry.score + 1u < kScores) ++entry.score;
    } else if (known && entry.score > 0) {
      --entry.score;
    } else {
      entry = {value, index, 0};
    }
  }

 private:
  [[nodiscard]] std::size_t slot(std::int32_t index) const {
    return static_cast<std::size_t>(index) & (entries_.size() - 1);
  }
  std::vector<Entry> entries_;
};

namespace exactness {

/// Decimals as the section says them. False: no such.
template <typename Source>
bool code_decimals(Source& source, std::optional<Decimals>& decimals, const std::optional<Decimals>& wanted) {
  if (source.raw(wanted ? 1 : 0, 1) == 0) return true;
  const Decimals want = wanted.value_or(Decimals());
  Decimals got;
  got.unit.multiple = static_cast<std::uint8_t>(source.raw(want.unit.multiple, 3));
  const std::uint32_t exponent = source.raw(static_cast<std::uint16_t>(want.unit.exponent), 16);
  got.unit.exponent = static_cast<std::int16_t>(exponent);
  got.digits = source.raw(want.digits, 4);
  decimals = got;
  return valid(got);
}

template <typename Source>
double code_double(Source& source, double wanted) {
  const auto bits = std::bit_cast<std::uint64_t>(wanted);
  const std::uint64_t high = source.raw(static_cast<std::uint32_t>(bits >> 32), 32);
  return std::bit_cast<double>(high << 32 | source.raw(static_cast<std::uint32_t>(bits & 0xFFFFFFFFu), 32));
}

template <typename Source>
bool code_grid(Source& source, std::optional<SteppedGrid>& grid, const std::optional<SteppedGrid>& wanted) {
  if (source.raw(wanted ? 1 : 0, 1) == 0) return true;
  const SteppedGrid want = wanted.value_or(SteppedGrid());
  SteppedGrid got;
  got.step = code_double(source, want.step);
  for (std::size_t axis = 0; axis < 3; ++axis) got.origin[axis] = code_double(source, want.origin[axis]);
  grid = got;
  return valid(got);
}

template <typename Source>
bool code_form(Source& source, ExactnessForm& form, const ExactnessForm& wanted) {
  if (!code_decimals(source, form.fine, wanted.fine) || !code_decimals(source, form.coarse, wanted.coarse))
    return false;
  if (!form.coarse && !code_grid(source, form.grid, wanted.grid)) return false;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const ExactnessForm::Axis& want = wanted.axes[axis];
    form.axes[axis].repeats = source.raw(want.repeats ? 1 : 0, 1) != 0;
    if (form.axes[axis].repeats) form.axes[axis].negated = source.raw(want.negated ? 1 : 0, 1) != 0;
    form.axes[axis].coarse = source.raw(want.coarse ? 1 : 0, 1) != 0;
    form.axes[axis].strays = source.raw(want.strays ? 1 : 0, 1) != 0;
    if (form.axes[axis].coarse && !form.coarse && !form.grid) return false;
  }
  return true;
}

struct AxisModels {
  std::array<std::array<AdaptiveBit, Repeats::kScores>, 3> again;  ///< by axes that came again before, and score
  AdaptiveBit coarse;
  StrayModel stray;
};

/// The float `steps` after `value`; not finite if there is none.
inline double stray_from(double value, std::int64_t steps, Scalar scalar) {
  const std::int64_t most = scalar == Scalar::float32 ? 0x7F7FFFFF : 0x7FEFFFFFFFFFFFFF;
  const auto from = static_cast<std::uint64_t>(to_ordered(value, scalar));
  const auto ordered = static_cast<std::int64_t>(from + static_cast<std::uint64_t>(steps));
  const bool beyond = ordered > most || ordered < -1 - most;
  return beyond ? std::numeric_limits<double>::infinity() : from_ordered(ordered, scalar);
}

/// The coarse numbers of a cell. REQUIRES: form.coarse or form.grid.
inline Cell coarse_cell(const Lattice& lattice, std::int32_t index, std::size_t axis, const ExactnessForm& form) {
  return form.grid ? grid_cell_of(lattice, index, axis, *form.grid, form.fine ? &*form.fine : nullptr)
                   : cell_of(lattice, index, axis, &*form.coarse);
}

/// One coordinate that is not one that came again; not finite if the stream is damaged.
template <typename Source>
double code_coordinate(Source& source, const LevelState& state, const ExactnessForm& form, AxisModels& models,
                       std::uint32_t vertex, std::size_t axis) {
  const std::int32_t index = state.points[vertex][axis] / 2;
  if (form.axes[axis].coarse) {
    const Cell cell = coarse_cell(state.lattice, index, axis, form);
    if (cell.count > 0 && source.bit(models.coarse, source.wanted_in(vertex, axis, cell))) {
      return cell.value(code_uniform64(source, source.wanted_number(vertex, axis, cell), cell.count));
    }
  }
  const Cell cell = cell_of(state.lattice, index, axis, form.fine ? &*form.fine : nullptr);
  double value = 0;
  if (cell.count > 0) {
    const std::uint64_t number = code_uniform64(source, source.wanted_number(vertex, axis, cell), cell.count);
    if (number >= cell.count) return std::numeric_limits<double>::infinity();
    value = cell.value(number);
  } else {
    value = state.lattice.position_of_middle(state.points[vertex])[axis];
  }
  if (!form.axes[axis].strays || !std::isfinite(value)) return value;
  const std::int64_t steps = models.stray.code(source, source.wanted_stray(vertex, axis, value));
  return steps == 0 ? value : stray_from(value, steps, state.lattice.scalar);
}

}  // namespace exactness

/// Every vertex's exact coordinates; points that are still middles of larger cells count as the index below. Errors:
/// corrupt_data.
template <typename Source>
Status code_exactness(LevelState& state, Source& source) {
  const std::optional<ExactnessForm> wanted = source.wanted_exactness();
  const bool any = source.raw(wanted ? 1 : 0, 1) != 0;
  if (!any) return {};
  const Error corrupt{ErrorCode::corrupt_data, 0, "the exactness section contradicts the lattice"};
  if (!state.lossless || state.lattice.exact || !state.exact.empty()) return corrupt;
  ExactnessForm form;
  if (!exactness::code_form(source, form, wanted.value_or(ExactnessForm())) || source.failed()) return corrupt;
  std::array<exactness::AxisModels, 3> models;
  const auto count = static_cast<std::uint32_t>(state.points.size());
  const Repeats nothing(0, state.lattice);
  std::array<Repeats, 3> repeats{nothing, nothing, nothing};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (form.axes[axis].negated && state.lattice.unit) return corrupt;
    if (form.axes[axis].repeats) repeats[axis] = Repeats(count, state.lattice);
  }
  state.exact.reserve(count);
  for (std::uint32_t v = 0; v < count; ++v) {
    Position position{};
    std::size_t came_again = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (!form.axes[axis].repeats) {
        position[axis] = exactness::code_coordinate(source, state, form, models[axis], v, axis);
      } else {
        const std::int32_t index = state.points[v][axis] / 2;
        const Repeats::Entry& entry = repeats[axis].at(index);
        const bool again = entry.index == index && source.bit(models[axis].again[came_again][entry.score],
                                                              source.wanted_exact(v, axis, entry.value));
        position[axis] = again ? entry.value : exactness::code_coordinate(source, state, form, models[axis], v, axis);
        came_again += again ? 1 : 0;
        repeats[axis].learn(index, position[axis]);
        if (form.axes[axis].negated && std::isfinite(position[axis])) {
          repeats[axis].learn(state.lattice.snap(-position[axis], static_cast<int>(axis)), -position[axis]);
        }
      }
      if (!std::isfinite(position[axis])) return corrupt;
    }
    if (source.failed()) return corrupt;
    state.exact.push_back(position);
  }
  source.told_part(PacketPart::exactness);
  return {};
}

}  // namespace pmcd::codec
