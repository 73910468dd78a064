// SPDX-License-Identifier: MIT
// The position of a base vertex, axis by axis. Where coordinates are found to repeat exactly (those of a neighbour, or
// the corner of a parallelogram, as in machine parts), that is asked first; else how far off the expectation it is.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include "codec/base/alphabet.h"
#include "codec/base/cell_model.h"
#include "codec/base/outlook.h"
#include "codec/entropy/adaptive_bit.h"
#include "codec/lattice/lattice.h"

namespace pmcd::codec {

class PositionModel {
 public:
  /// A vertex beyond a gate. False: damaged data.
  template <typename Source>
  bool code_new(Source& source, const std::array<Alphabet, 3>& alphabets, const Outlook& outlook,
                const LatticePoint& wanted, LatticePoint& cell) {
    // The axis along which the normal is longest comes last: the expected covariance is an ellipsoid about the normal,
    // and each coordinate is expected given those before it (conditional Gaussian).
    const Vec& n = outlook.normal;
    std::array<std::size_t, 3> order = {0, 1, 2};
    auto longer = [&](std::size_t i, std::size_t j) { return n[i] * n[i] > n[j] * n[j]; };
    if (longer(order[0], order[1])) std::swap(order[0], order[1]);
    if (longer(order[1], order[2])) std::swap(order[1], order[2]);
    if (longer(order[0], order[1])) std::swap(order[0], order[1]);
    const double t = outlook.tangential * outlook.tangential;
    const double difference = outlook.across * outlook.across - t;
    std::array<std::array<double, 3>, 3> factor{};
    std::array<double, 3> z{};
    std::size_t hits = 0;  // of the axes before: they come together
    for (std::size_t i = 0; i < 3; ++i) {
      const std::size_t axis = order[i];
      double expected = outlook.position[axis];
      double variance = difference * n[axis] * n[axis] + t;
      for (std::size_t j = 0; j < i; ++j) {
        double sum = difference * n[axis] * n[order[j]];
        for (std::size_t k = 0; k < j; ++k) sum -= factor[i][k] * factor[j][k];
        factor[i][j] = sum / factor[j][j];
        variance -= factor[i][j] * factor[i][j];
        expected += factor[i][j] * z[j];
      }
      constexpr double kLeastVariance = 4e-4;
      factor[i][i] = std::sqrt(variance > kLeastVariance ? variance : kLeastVariance);
      const Alphabet& alphabet = alphabets[axis];
      const auto wanted_number = nearest(alphabet, wanted[axis]);
      std::array<std::int32_t, Outlook::kExact> exact{};
      std::int32_t number = -1;
      for (std::size_t kind = 0; kind < exact.size(); ++kind) {
        exact[kind] = outlook.exact_known[kind] ? nearest(alphabet, outlook.exact[kind][axis]) : -1;
        const bool again = std::find(exact.begin(), exact.begin() + static_cast<std::ptrdiff_t>(kind), exact[kind]) !=
                           exact.begin() + static_cast<std::ptrdiff_t>(kind);
        if (number >= 0 || exact[kind] < 0 || again || share_[axis][kind] < kWorthAsking) continue;
        if (source.bit(hit_[axis][kind][hits], wanted_number == exact[kind])) number = exact[kind];
      }
      hits = 2 * hits + (number >= 0 ? 2 : 1);  // 0; 1, 2; 3 .. 6 before the next axis
      if (number < 0) {
        number = residual_.code(source, wanted_number, alphabet.number(expected),
                                alphabet.spread(expected, factor[i][i]), alphabet.most());
        if (number < 0) return false;
      }
      for (std::size_t kind = 0; kind < exact.size(); ++kind) {
        if (exact[kind] < 0) continue;
        std::uint32_t& share = share_[axis][kind];
        share = exact[kind] == number ? share + (kOne - share) / 32 : share - share / 32;
      }
      cell[axis] = alphabet.cell(number);
      z[i] = std::clamp((cell[axis] - expected) / factor[i][i], -8.0, 8.0);
    }
    return true;
  }

  /// A vertex that has only another one to go by. False: damaged data.
  template <typename Source>
  bool code_start(Source& source, const std::array<Alphabet, 3>& alphabets, const LatticePoint& from, double spread,
                  const LatticePoint& wanted, LatticePoint& cell) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const Alphabet& alphabet = alphabets[axis];
      const std::int32_t number = start_.code(source, nearest(alphabet, wanted[axis]), alphabet.number(from[axis]),
                                              alphabet.spread(from[axis], spread), alphabet.most());
      if (number < 0) return false;
      cell[axis] = alphabet.cell(number);
    }
    return true;
  }

 private:
  static constexpr std::uint32_t kOne = 1u << 16;
  static constexpr std::uint32_t kWorthAsking = kOne / 6;

  static std::int32_t nearest(const Alphabet& alphabet, double cell) {
    const double above = alphabet.number(cell) + 0.5;
    return static_cast<std::int32_t>(above);  // never below 0
  }

  CellModel start_;
  CellModel residual_;
  // By axis and kind of exact value: how often it comes true lately, times kOne.
  std::array<std::array<std::uint32_t, Outlook::kExact>, 3> share_{};
  std::array<std::array<std::array<AdaptiveBit, 7>, Outlook::kExact>, 3> hit_;
};

}  // namespace pmcd::codec
