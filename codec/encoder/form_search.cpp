// SPDX-License-Identifier: MIT
#include "codec/encoder/form_search.h"

#include <bit>
#include <cmath>
#include <utility>

#include "codec/encoder/code_length.h"
#include "codec/exactness.h"
#include "codec/lattice/cell.h"

namespace pmcd::codec {
namespace {

bool same_bits(double a, double b) {
  return std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b);
}

}  // namespace

FormSearch::FormSearch(const Lattice& lattice, std::span<const Position> sample, const Candidates& candidates)
    : lattice_(lattice), sample_(sample), fine_(measure_fine(nullptr)) {
  for (const Decimals& fine : candidates.fine) {
    FineCosts costs = measure_fine(&fine);
    if (costs.bits >= fine_.bits) continue;
    fine_ = std::move(costs);
    without_.fine = fine;
  }
  best_ = {without_, fine_.bits};
  for (const Multiples& coarse : candidates.coarse) {
    ExactnessForm form = without_;
    form.coarse = Decimals{coarse.unit, 0};
    consider_coarse(form);
  }
}

void FormSearch::consider(const SteppedGrid& grid) {
  ExactnessForm form = without_;
  form.grid = grid;
  consider_coarse(form);
}

FormSearch::FineCosts FormSearch::measure_fine(const Decimals* fine) const {
  FineCosts result;
  const auto total = static_cast<double>(sample_.size());
  for (std::size_t axis = 0; axis < 3; ++axis) {
    double strays = 0;
    result.each[axis].reserve(sample_.size());
    for (const Position& p : sample_) {
      FineCosts::One one;
      one.index = lattice_.snap(p[axis], static_cast<int>(axis));
      const Cell cell = cell_of(lattice_, one.index, axis, fine);
      double value = 0;
      if (cell.count > 0) {
        one.bits = binary_log(static_cast<double>(cell.count));
        value = cell.value(cell.nearest(p[axis]));
      } else {
        value = lattice_.position(lattice_.snap(p))[axis];
      }
      one.stray = !same_bits(value, p[axis]);
      if (one.stray) {
        const double off = static_cast<double>(to_ordered(value, lattice_.scalar)) -
                           static_cast<double>(to_ordered(p[axis], lattice_.scalar));
        one.bits += 1 + 1.8 * binary_log(std::abs(off) + 1);
        strays += 1;
      }
      result.of_axis[axis] += one.bits;
      result.each[axis].push_back(one);
    }
    result.of_axis[axis] += entropy(strays, total);
    result.bits += result.of_axis[axis];
  }
  result.bits /= 3 * total;
  return result;
}

// With the coarse numbers of `form`, on the axes where they pay. REQUIRES: form.coarse or form.grid.
void FormSearch::consider_coarse(ExactnessForm& form) {
  double bits = 0;
  const auto total = static_cast<double>(sample_.size());
  for (std::size_t axis = 0; axis < 3; ++axis) {
    double with = 0;
    double strays = 0;
    double coarse = 0;
    double asked = 0;
    for (std::size_t v = 0; v < sample_.size(); ++v) {
      const FineCosts::One& one = fine_.each[axis][v];
      const Cell few = exactness::coarse_cell(lattice_, one.index, axis, form);
      if (few.count > 0) asked += 1;
      if (few.count > 0 && same_bits(few.value(few.nearest(sample_[v][axis])), sample_[v][axis])) {
        coarse += 1;
        with += binary_log(static_cast<double>(few.count));
      } else {
        with += one.bits;
        strays += one.stray ? 1 : 0;
      }
    }
    with += entropy(coarse, asked) + entropy(strays, total - coarse);
    form.axes[axis].coarse = with + 16 < fine_.of_axis[axis];
    bits += form.axes[axis].coarse ? with : fine_.of_axis[axis];
  }
  bits /= 3 * total;
  if (bits < best_.bits) best_ = {form, bits};
}

}  // namespace pmcd::codec
