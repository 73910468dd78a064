// SPDX-License-Identifier: MIT
#include "codec/encoder/exactness_search.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include "codec/encoder/code_length.h"
#include "codec/encoder/form_search.h"
#include "codec/encoder/stepped_grid.h"
#include "codec/exactness.h"
#include "codec/lattice/cell.h"

namespace pmcd::codec {
namespace {

// Vertices of the sample on which forms are compared. What they miss costs bits, never exactness.
constexpr std::size_t kSample = 1536;
// The lattice of a unit has no more bits: finer than that costs the same in the end, but all levels before it more. And
// no fewer under an exactness section, for the sake of the levels.
constexpr unsigned kMostBits = 16;
constexpr unsigned kLeastBits = 11;
// Of the coordinates, how many must be multiples of a unit for its lattice to be worth a try.
constexpr double kWorthLattice = 0.5;
constexpr double kWorthDigits = 0.3;
constexpr double kWorthCoarse = 0.1;
// What a lattice that is not exact must save, in bits a coordinate: a section has a form, a packet and a pass of its
// own.
constexpr double kWorthSection = 0.01;
// How many units the largest extent may have.
constexpr double kFewestSteps = 16;
constexpr double kMostSteps = 1 << 25;

std::vector<Position> sample_of(const TriangleMesh& mesh) {
  std::vector<Position> sample;
  const std::size_t stride = mesh.positions.size() / kSample + 1;
  for (std::size_t v = 0; v < mesh.positions.size(); v += stride) sample.push_back(mesh.positions[v]);
  return sample;
}

std::int64_t nearest_whole(const Unit& unit, double value) {
  return whole_below(in_units(unit, value) + 0.5);
}

// The share of the sample's coordinates that are multiples of the unit.
double share_of(const Unit& unit, std::span<const Position> sample, Scalar scalar) {
  std::size_t hits = 0;
  for (const Position& p : sample) {
    for (double value : p) hits += round_to(scalar, multiple_of(unit, nearest_whole(unit, value))) == value ? 1 : 0;
  }
  return static_cast<double>(hits) / static_cast<double>(3 * sample.size());
}

// Units of which the largest extent has 2^4 to 2^25, large ones first, that many coordinates are multiples of, and more
// than of the larger units of their kind.
std::vector<Multiples> multiples_in(std::span<const Position> sample, Scalar scalar, double extent) {
  std::vector<Multiples> result;
  double least = kWorthCoarse;
  auto add = [&](std::uint8_t multiple, int exponent) {
    const Unit unit{multiple, static_cast<std::int16_t>(exponent)};
    const double size = multiple_of(unit, 1);
    if (size * kFewestSteps > extent || size * kMostSteps < extent || least > 1) return;
    const double share = share_of(unit, sample, scalar);
    if (share < least) return;
    least = share == 1 ? 2 : std::min(share + 0.02, 1.0);
    result.push_back({unit, share});
  };
  for (int exponent = kMaxPowerOfTen; exponent >= -kMaxPowerOfTen; --exponent) {
    for (std::uint8_t multiple : {std::uint8_t{5}, std::uint8_t{2}, std::uint8_t{1}}) add(multiple, exponent);
  }
  least = 1;  // powers of two hold all or are of no use
  for (int exponent = kMaxPowerOfTwo; exponent >= -kMaxPowerOfTwo; --exponent) add(0, exponent);
  return result;
}

// The decimal exponent of a magnitude, up to a rounding: 10^e <= magnitude < 10^(e+1). Limited to the powers we have.
int decade_of(double magnitude) {
  int e = 0;
  while (e < kMaxPowerOfTen && magnitude >= power_of_ten(e + 1)) ++e;
  if (e > 0) return e;
  while (e > -kMaxPowerOfTen && magnitude * power_of_ten(-e) < 1) --e;
  return e;
}

// For each number of digits, how much of the sample has no more, and the smallest unit that these need.
struct Digits {
  std::array<double, kMaxDigits + 1> share{};
  std::array<int, kMaxDigits + 1> exponent{};
};

Digits count_digits(std::span<const Position> sample, Scalar scalar) {
  Digits digits;
  digits.exponent.fill(kMaxPowerOfTen);
  const unsigned most = scalar == Scalar::float32 ? 9 : kMaxDigits;
  for (const Position& p : sample) {
    for (double value : p) {
      if (value == 0) {
        for (double& share : digits.share) share += 1;
        continue;
      }
      const int decade = decade_of(std::abs(value));
      for (unsigned n = 1; n <= most; ++n) {
        const int exponent = decade - static_cast<int>(n) + 1;
        if (exponent < -kMaxPowerOfTen || exponent > kMaxPowerOfTen) continue;
        const Unit unit{1, static_cast<std::int16_t>(exponent)};
        if (round_to(scalar, multiple_of(unit, nearest_whole(unit, value))) != value) continue;
        for (unsigned m = n; m <= most; ++m) {
          digits.share[m] += 1;
          digits.exponent[m] = std::min(digits.exponent[m], exponent);
        }
        break;
      }
    }
  }
  for (double& share : digits.share) share /= static_cast<double>(3 * sample.size());
  return digits;
}

double extent_of(const Lattice& lattice) {
  return lattice.step * lattice.max_index();
}

// Decimals of limited digits that are worth a try.
std::vector<Decimals> decimals_for(std::span<const Position> sample, Scalar scalar) {
  std::vector<Decimals> result;
  const Digits digits = count_digits(sample, scalar);
  for (unsigned n = 1; n <= kMaxDigits; ++n) {
    if (digits.share[n] < kWorthDigits) continue;
    for (int more = 0; more < 4 && digits.exponent[n] + more <= kMaxPowerOfTen; ++more) {
      result.push_back({{1, static_cast<std::int16_t>(digits.exponent[n] + more)}, n});
    }
    if (digits.share[n] == 1) break;
  }
  return result;
}

Candidates candidates_for(std::span<const Position> sample, Scalar scalar, double extent) {
  Candidates result;
  result.fine = decimals_for(sample, scalar);
  result.coarse = multiples_in(sample, scalar, extent);
  for (const Multiples& multiples : result.coarse) {
    if (multiples.share >= kWorthDigits) result.fine.push_back({multiples.unit, 0});
  }
  return result;
}

// The lattice whose points are those of a grid.
Lattice of_grid(const TriangleMesh& mesh, const SteppedGrid& grid) {
  Lattice lattice;
  lattice.scalar = mesh.scalar;
  lattice.bits = kMinLatticeBits;
  lattice.step = grid.step;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    std::int64_t low = kMaxWhole;
    std::int64_t high = -kMaxWhole;
    for (const Position& p : mesh.positions) {
      const std::int64_t n = whole_below((p[axis] - grid.origin[axis]) / grid.step + 0.5);
      low = std::min(low, n);
      high = std::max(high, n);
    }
    lattice.min[axis] = grid.origin[axis] + static_cast<double>(low) * grid.step;
    while (lattice.bits <= kMaxLatticeBits && high - low > lattice.max_index()) ++lattice.bits;
  }
  return lattice;
}

bool same_bits(double a, double b) {
  return std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b);
}

bool holds_all(const Lattice& lattice, const TriangleMesh& mesh) {
  for (const Position& p : mesh.positions) {
    const Position q = lattice.position(lattice.snap(p));
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (!same_bits(p[axis], q[axis])) return false;
    }
  }
  return true;
}

// What a table of repeats would save.
struct RepeatsTrial {
  RepeatsTrial(std::size_t vertices, const Lattice& lattice) : repeats(vertices, lattice) {}

  void add(std::int32_t index, double value, double cost) {
    const Repeats::Entry& entry = repeats.at(index);
    if (entry.index == index) {
      const bool again = same_bits(entry.value, value);
      counts[entry.score][again ? 1 : 0] += 1;
      costs += again ? cost : 0;
    }
    repeats.learn(index, value);
  }
  [[nodiscard]] double saved() const {
    double result = costs;
    for (const auto& [other, again] : counts) result -= entropy(again, again + other);
    return result;
  }

  Repeats repeats;
  std::array<std::array<double, 2>, Repeats::kScores> counts{};
  double costs = 0;
};

// All coordinates, in the order of the file for want of the decoder's: who strays, and whether repeats pay.
void look_at_all(const TriangleMesh& mesh, const Lattice& lattice, ExactnessForm& form) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    RepeatsTrial plain(mesh.positions.size(), lattice);
    RepeatsTrial negated(mesh.positions.size(), lattice);
    for (const Position& p : mesh.positions) {
      const double wanted = p[axis];
      const std::int32_t index = lattice.snap(wanted, static_cast<int>(axis));
      double cost = 0;
      if (form.axes[axis].coarse) {
        const Cell few = exactness::coarse_cell(lattice, index, axis, form);
        if (few.count > 0 && same_bits(few.value(few.nearest(wanted)), wanted)) {
          cost = 0.5 + binary_log(static_cast<double>(few.count));
        }
      }
      if (cost == 0) {
        const Cell cell = cell_of(lattice, index, axis, form.fine ? &*form.fine : nullptr);
        const double value =
            cell.count > 0 ? cell.value(cell.nearest(wanted)) : lattice.position(lattice.snap(p))[axis];
        const bool strays = !same_bits(value, wanted);
        form.axes[axis].strays = form.axes[axis].strays || strays;
        cost = (cell.count > 0 ? binary_log(static_cast<double>(cell.count)) : 0) + (strays ? 4 : 0);
      }
      plain.add(index, wanted, cost);
      negated.add(index, wanted, cost);
      negated.repeats.learn(lattice.snap(-wanted, static_cast<int>(axis)), -wanted);
    }
    const double saved = plain.saved();
    const double saved_negated = negated.saved();
    form.axes[axis].negated = !lattice.unit && saved_negated > saved + 64;
    form.axes[axis].repeats = (form.axes[axis].negated ? saved_negated : saved) > 64;
  }
}

}  // namespace

LosslessPlan plan_lossless(const TriangleMesh& mesh, const Lattice& plain) {
  LosslessPlan best{plain, {}};
  if (mesh.positions.empty()) return best;
  const std::vector<Position> sample = sample_of(mesh);
  const double extent = extent_of(plain);
  const Candidates candidates = candidates_for(sample, mesh.scalar, extent);
  FormSearch of_plain(plain, sample, candidates);
  std::optional<Decimals> rounded_to = of_plain.best().form.fine;
  // The sample may have missed the smallest coordinates, which tell most of a step.
  if (rounded_to && rounded_to->digits > 0) {
    rounded_to->unit.exponent = static_cast<std::int16_t>(std::max(rounded_to->unit.exponent - 4, -kMaxPowerOfTen));
  }
  const SteppedGridSearch grid_search(mesh, rounded_to ? &*rounded_to : nullptr);
  std::vector<SteppedGrid> grids;
  for (double blur : {0.0, 2e-8, 2e-7}) {
    const std::optional<SteppedGrid> grid = grid_search.find(blur * extent);
    if (grid) grids.push_back(*grid);
  }

  // A bit more of lattice costs a bit more of geometry.
  double best_bits = std::numeric_limits<double>::infinity();
  auto compare = [&](const Lattice& lattice, const FormChoice& choice) {
    const double section = lattice.exact ? 0 : kWorthSection;
    const double bits = choice.bits + section + (lattice.step > 0 ? binary_log(extent / lattice.step) : 0);
    if (bits >= best_bits) return;
    best = {lattice, choice.form};
    best_bits = bits;
  };
  auto search = [&](const Lattice& lattice, FormSearch& forms) {
    for (const SteppedGrid& grid : grids) forms.consider(grid);
    compare(lattice, forms.best());
  };
  auto consider = [&](const Lattice& lattice) {
    FormSearch forms(lattice, sample, candidates);
    search(lattice, forms);
  };
  search(plain, of_plain);
  for (const Multiples& multiples : candidates.coarse) {
    if (multiples.share < kWorthLattice || multiple_of(multiples.unit, 1) * (1 << kMostBits) < extent) continue;
    std::optional<Lattice> lattice = Lattice::of_multiples(mesh, multiples.unit);
    if (!lattice || lattice->bits > kMostBits) continue;
    lattice->exact = multiples.share == 1 && holds_all(*lattice, mesh);
    if (lattice->exact) {
      compare(*lattice, {});
    } else if (lattice->bits >= kLeastBits) {
      consider(*lattice);
    }
  }
  for (const SteppedGrid& grid : grids) {
    const Lattice lattice = of_grid(mesh, grid);
    if (lattice.valid() && lattice.bits >= kLeastBits && lattice.bits <= kMostBits) consider(lattice);
  }
  if (!best.lattice.exact) look_at_all(mesh, best.lattice, best.form);
  return best;
}

}  // namespace pmcd::codec
