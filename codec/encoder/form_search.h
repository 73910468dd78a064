// SPDX-License-Identifier: MIT
// Which form of the exactness section costs least over a lattice, measured on a sample of the vertices.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "codec/lattice/decimals.h"
#include "codec/lattice/exactness_form.h"
#include "codec/lattice/lattice.h"
#include "codec/mesh/triangle_mesh.h"

namespace pmcd::codec {

struct Multiples {
  Unit unit;
  double share = 0;  // of the sample's coordinates
};

/// What is worth a try.
struct Candidates {
  std::vector<Decimals> fine;
  std::vector<Multiples> coarse;
};

struct FormChoice {
  ExactnessForm form;
  double bits = 0;  ///< a coordinate, without repeats
};

/// All candidates are measured once, when it is made; grids when they are told. REQUIRES: lattice and sample outlive
/// it.
class FormSearch {
 public:
  FormSearch(const Lattice& lattice, std::span<const Position> sample, const Candidates& candidates);

  void consider(const SteppedGrid& grid);
  [[nodiscard]] const FormChoice& best() const { return best_; }

 private:
  // What the section would spend on the sample without coarse numbers, by axis and coordinate.
  struct FineCosts {
    struct One {
      double bits = 0;
      bool stray = false;
      std::int32_t index = 0;
    };
    std::array<std::vector<One>, 3> each;
    std::array<double, 3> of_axis{};
    double bits = 0;  // a coordinate
  };

  [[nodiscard]] FineCosts measure_fine(const Decimals* fine) const;
  void consider_coarse(ExactnessForm& form);

  const Lattice& lattice_;
  std::span<const Position> sample_;
  FineCosts fine_;         // of the form that is best without coarse numbers
  ExactnessForm without_;  // this form
  FormChoice best_;
};

}  // namespace pmcd::codec
