// SPDX-License-Identifier: MIT
// Weighted least squares that forgets: normal equations of the newest observations, solved now and then by Cholesky
// with a ridge towards given weights. Deterministic: + - * / and sqrt in a fixed order. It knows nothing of meshes.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <span>

#include "codec/entropy/softmax.h"

namespace pmcd::codec {

/// `Terms` unknowns for each of `Targets` right-hand sides that share the observations' features.
template <std::size_t Terms, std::size_t Targets>
class LeastSquares {
 public:
  static constexpr std::size_t kWidth = (Terms + Targets + 3) / 4 * 4;
  /// One scalar equation: the features, then the targets, then zeros. Of vectors there is one for each axis.
  using Equation = Lanes<kWidth>;
  using Weights = std::array<float, Terms>;

  struct Tuning {
    float decay = 0.995f;       ///< of what an observation counts when the next one comes
    float ridge = 1;            ///< importance of the prior weights
    unsigned solve_every = 16;  ///< observations between two solutions
  };

  LeastSquares(const Tuning& tuning, const std::array<Weights, Targets>& prior)
      : inverse_decay_(1 / tuning.decay), tuning_(tuning), prior_(prior), weight_(prior) {}

  [[nodiscard]] const Weights& weight(std::size_t target) const { return weight_[target]; }

  /// [equations x Terms x kWidth / 4 steps; every so often Terms^3 / 6]
  void observe(float importance, std::span<const Equation> equations) {
    // Instead of shrinking all that was seen, the newest counts more; all is scaled down when it is solved.
    growth_ *= inverse_decay_;
    const float scale = importance * growth_;
    for (std::size_t i = 0; i < Terms; ++i) {
      Equation sum = row_[i];
      for (const Equation& equation : equations) add_scaled(sum, scale * equation.value[i], equation);
      row_[i] = sum;
    }
    if (++since_solved_ < tuning_.solve_every) return;
    since_solved_ = 0;
    const float shrink = 1 / growth_;
    growth_ = 1;
    for (Equation& row : row_) {
      for (float& value : row.value) value *= shrink;
    }
    solve();
  }

 private:
  static constexpr double kSmallest = 1e-9;

  // A system that is not positive keeps the old weights.
  void solve() {
    std::array<std::array<double, Terms>, Terms> factor;
    std::array<double, Terms> inverse;
    for (std::size_t i = 0; i < Terms; ++i) {
      for (std::size_t j = 0; j <= i; ++j) {
        double sum = static_cast<double>(row_[i].value[j]) + (i == j ? static_cast<double>(tuning_.ridge) : 0);
        for (std::size_t k = 0; k < j; ++k) sum -= factor[i][k] * factor[j][k];
        if (i == j) {
          if (!(sum > kSmallest)) return;
          inverse[i] = 1 / std::sqrt(sum);
          factor[i][i] = sum * inverse[i];
        } else {
          factor[i][j] = sum * inverse[j];
        }
      }
    }
    for (std::size_t target = 0; target < Targets; ++target) {
      std::array<double, Terms> solution;
      for (std::size_t i = 0; i < Terms; ++i) {
        double known = static_cast<double>(row_[i].value[Terms + target]) +
                       static_cast<double>(tuning_.ridge) * static_cast<double>(prior_[target][i]);
        for (std::size_t k = 0; k < i; ++k) known -= factor[i][k] * solution[k];
        solution[i] = known * inverse[i];
      }
      for (std::size_t i = Terms; i-- > 0;) {
        double known = solution[i];
        for (std::size_t k = i + 1; k < Terms; ++k) known -= factor[k][i] * solution[k];
        solution[i] = known * inverse[i];
      }
      for (std::size_t i = 0; i < Terms; ++i) weight_[target][i] = static_cast<float>(solution[i]);
    }
  }

  float growth_ = 1;
  float inverse_decay_;
  unsigned since_solved_ = 0;
  Tuning tuning_;
  std::array<Weights, Targets> prior_;
  std::array<Weights, Targets> weight_;
  std::array<Equation, Terms> row_{};
};

}  // namespace pmcd::codec
