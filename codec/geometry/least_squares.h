// SPDX-License-Identifier: MIT
// Weighted least squares that forgets: normal equations of the newest observations, solved now and then by Cholesky
// with a ridge towards given weights. Deterministic: + - * / and sqrt in a fixed order. It knows nothing of meshes.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>

namespace pmcd::codec {

/// `Terms` unknowns for each of `Targets` right-hand sides that share the observations' features.
template <std::size_t Terms, std::size_t Targets>
class LeastSquares {
 public:
  using Weights = std::array<double, Terms>;

  struct Tuning {
    double decay = 0.995;       ///< of what an observation counts when the next one comes
    double ridge = 1;           ///< importance of the prior weights
    unsigned solve_every = 16;  ///< observations between two solutions
  };

  LeastSquares(const Tuning& tuning, const std::array<Weights, Targets>& prior)
      : tuning_(tuning), prior_(prior), weight_(prior) {}

  [[nodiscard]] const Weights& weight(std::size_t target) const { return weight_[target]; }

  /// Adds an observation: `add(i, j)` answers the product of features i and j, `right(target, i)` that of feature i and
  /// the target. [Terms^2 / 2 products; every so often Terms^3 / 6]
  template <typename Product, typename Right>
  void observe(double importance, const Product& product, const Right& right) {
    // Instead of shrinking all that was seen, the newest counts more; both are scaled down before that overflows.
    growth_ *= 1 / tuning_.decay;
    const double scale = importance * growth_;
    std::size_t at = 0;
    for (std::size_t i = 0; i < Terms; ++i) {
      for (std::size_t j = 0; j <= i; ++j, ++at) matrix_[at] += scale * product(i, j);
    }
    for (std::size_t target = 0; target < Targets; ++target) {
      for (std::size_t i = 0; i < Terms; ++i) right_[target][i] += scale * right(target, i);
    }
    if (++since_solved_ < tuning_.solve_every) return;
    since_solved_ = 0;
    const double shrink = 1 / growth_;
    growth_ = 1;
    for (double& value : matrix_) value *= shrink;
    for (Weights& values : right_) {
      for (double& value : values) value *= shrink;
    }
    solve();
  }

 private:
  static constexpr double kSmallest = 1e-9;

  // A system that is not positive keeps the old weights.
  void solve() {
    std::array<double, Terms*(Terms + 1) / 2> factor{};
    std::array<double, Terms> inverse{};
    std::size_t row = 0;
    for (std::size_t i = 0; i < Terms; ++i) {
      std::size_t other = 0;
      for (std::size_t j = 0; j <= i; ++j) {
        double sum = matrix_[row + j] + (i == j ? tuning_.ridge : 0);
        for (std::size_t k = 0; k < j; ++k) sum -= factor[row + k] * factor[other + k];
        if (i == j) {
          if (!(sum > kSmallest)) return;
          inverse[i] = 1 / std::sqrt(sum);
          factor[row + i] = sum * inverse[i];
        } else {
          factor[row + j] = sum * inverse[j];
        }
        other += j + 1;
      }
      row += i + 1;
    }
    for (std::size_t target = 0; target < Targets; ++target) {
      Weights solution{};
      row = 0;
      for (std::size_t i = 0; i < Terms; ++i) {
        double known = right_[target][i] + tuning_.ridge * prior_[target][i];
        for (std::size_t k = 0; k < i; ++k) known -= factor[row + k] * solution[k];
        solution[i] = known * inverse[i];
        row += i + 1;
      }
      for (std::size_t i = Terms; i-- > 0;) {
        double known = solution[i];
        for (std::size_t k = i + 1; k < Terms; ++k) known -= factor[k * (k + 1) / 2 + i] * solution[k];
        solution[i] = known * inverse[i];
      }
      weight_[target] = solution;
    }
  }

  Tuning tuning_;
  std::array<Weights, Targets> prior_;
  std::array<Weights, Targets> weight_;
  std::array<double, Terms*(Terms + 1) / 2> matrix_{};
  std::array<Weights, Targets> right_{};
  double growth_ = 1;
  unsigned since_solved_ = 0;
};

}  // namespace pmcd::codec
