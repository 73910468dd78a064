// SPDX-License-Identifier: MIT
// From one level to the next: first the connectivity of all the packet's passes, then the positions of all their
// vertices, which so see the finest connectivity, then further digits of the older positions. The decoder reads through
// these functions, the encoder writes through them. They check what a packet can get wrong; they do not look at
// headers.
#pragma once

#include <algorithm>
#include <array>
#include <vector>

#include "codec/conquest/conquest.h"
#include "codec/conquest/ears.h"
#include "codec/geometry/position_coder.h"
#include "codec/geometry/provisional.h"
#include "codec/geometry/ring_walk.h"
#include "codec/level_state.h"
#include "codec/result.h"
#include "codec/source.h"

namespace pmcd::codec {

/// Counts that a pass may not exceed: what the packet's header promised and the decoder's limits allowed.
struct LevelBounds {
  std::uint32_t vertices = 0;
  std::uint32_t faces = 0;
};

/// sum / count, rounded, halves up. REQUIRES: 3 <= count <= 6, sum < 2^28; then this is what division gives, in less
/// time.
inline std::int32_t rounded_mean(std::uint32_t sum, unsigned count) {
  constexpr auto kOneBy = [](unsigned n) { return (std::uint64_t{1} << 40) / (2 * n) + 1; };
  constexpr std::array<std::uint64_t, 7> kInverse = {0, 0, 0, kOneBy(3), kOneBy(4), kOneBy(5), kOneBy(6)};
  return static_cast<std::int32_t>(((2 * sum + count) * kInverse[count]) >> 40);
}

/// The conquest's driver on the decoder's side: opens patches and inserts vertices at provisional positions.
template <typename Source>
class InsertingDriver {
 public:
  InsertingDriver(LevelState& state, Marks& marks, PassKind kind, std::uint32_t previous, const LevelBounds& bounds,
                  Source& source)
      : state_(state),
        marks_(marks),
        kind_(kind),
        bounds_(bounds),
        source_(source),
        surroundings_(state.mesh, state.points, kind, previous, bounds.vertices) {}

  void step_over(std::uint32_t gate) { surroundings_.keep(state_.mesh, gate); }

  Symbol decide(std::uint32_t gate, Tag tag_s, Tag tag_t, Patch& patch) {
    if (source_.failed()) return kImpossible;
    const Symbol wanted = source_.wanted_symbol();
    HalfEdgeMesh& mesh = state_.mesh;
    SymbolModel& model = kind_ == PassKind::cleaning ? state_.models.clean : state_.models.symbol;
    const Hypothesis* holds = model.code(source_, surroundings_, mesh, marks_, gate, tag_s, tag_t, wanted);
    if (holds == nullptr) return kImpossible;
    const Symbol symbol = holds->symbol;
    if (symbol == kNull) {
      surroundings_.keep(mesh, gate);
      return symbol;
    }
    patch = holds->patch;
    if (mesh.vertex_count() >= bounds_.vertices ||
        mesh.face_count() + 2 > bounds_.faces + (patch.is_border() ? 1 : 0)) {
      return kImpossible;
    }
    const Triangulation& triangulation = kind_ == PassKind::cleaning ? interior_triangulation(3, Tag::plus, Tag::minus)
                                         : patch.is_border() ? border_triangulation(patch.size, patch.closing, tag_t)
                                                             : interior_triangulation(patch.size, tag_s, tag_t);
    std::array<std::uint32_t, 3> sum{};  // of at most six points below 2^25, so this is no narrowing
    for (std::uint32_t v : patch.ring_vertices()) {
      for (std::size_t axis = 0; axis < 3; ++axis) sum[axis] += static_cast<std::uint32_t>(state_.points[v][axis]);
    }
    LatticePoint provisional{};
    for (std::size_t axis = 0; axis < 3; ++axis) provisional[axis] = rounded_mean(sum[axis], patch.size);
    const std::uint32_t vertex = mesh.add_vertex();
    state_.points.push_back(provisional);
    insert_centre(mesh, patch, triangulation, vertex);
    surroundings_.insert(*holds, triangulation, provisional);
    source_.told_inserted(vertex);
    return symbol;
  }

 private:
  LevelState& state_;
  Marks& marks_;
  PassKind kind_;
  LevelBounds bounds_;
  Source& source_;
  Surroundings surroundings_;
};

/// The inserting side of an ear pass (conquest/ears.h). False: the packet is damaged. [linear in the half-edges]
template <typename Source>
bool insert_ears(LevelState& state, const LevelBounds& bounds, Source& source) {
  HalfEdgeMesh& mesh = state.mesh;
  const std::uint32_t faces = mesh.face_count();
  for (std::uint32_t i = 0; i < 3 * faces; ++i) {
    const std::uint32_t h = HalfEdgeMesh::halfedge(i / 3, i % 3);
    if (mesh.opposite(h) != kNone) continue;
    if (!source.bit(state.models.ear, source.wanted_ear(mesh.origin(h)))) continue;
    if (source.failed() || mesh.vertex_count() >= bounds.vertices || mesh.face_count() >= bounds.faces) return false;
    const LatticePoint& a = state.points[mesh.origin(h)];
    const LatticePoint& b = state.points[mesh.target(h)];
    const LatticePoint provisional{(a[0] + b[0]) / 2, (a[1] + b[1]) / 2, (a[2] + b[2]) / 2};
    const std::uint32_t vertex = mesh.add_vertex();
    state.points.push_back(provisional);
    insert_ear(mesh, h, vertex);
    source.told_inserted(vertex);
  }
  return true;
}

/// The connectivity of one pass; its vertices stand at provisional positions. Errors: corrupt_data.
template <typename Source>
Status code_connectivity(LevelState& state, Marks& marks, PassKind kind, const LevelBounds& bounds, Source& source) {
  const std::uint32_t before = state.mesh.vertex_count();
  const std::uint32_t previous = state.models.symbol.begin_pass(before);
  auto walk = [&] {
    InsertingDriver<Source> driver(state, marks, kind, previous, bounds, source);
    return conquer(state.mesh, state.seeds, kind, marks, driver);
  };
  if (kind == PassKind::ears ? !insert_ears(state, bounds, source) : !walk()) {
    return Error{ErrorCode::corrupt_data, before, "the packet's connectivity contradicts itself"};
  }
  // Memory is met in the order of the walk from now on. A walk meets every face.
  if (kind != PassKind::ears && marks.order.size() == state.mesh.face_count()) state.mesh.reorder(marks.order);
  if (state.mesh.vertex_count() == before) {
    return Error{ErrorCode::corrupt_data, before, "a pass that inserts nothing"};
  }
  return {};
}

/// A position is known: learns from it and puts the vertex there.
inline void settle(LevelState& state, Surface& surface, const Ring& ring, const Expectation& expected, std::uint32_t v,
                   const LatticePoint& point) {
  const RelativeSpread spread = state.predictor.learn(expected, point);
  if (expected.stage != kFurtherDigits) state.spreads[v] = surface[v].spread = spread;
  surface.move(state.mesh, ring, v, point);
  state.points[v] = point;
}

/// The positions of the vertices from `first` to before `end`; `later_passes`: how many passes of the packet follow
/// whose positions are not known yet. Errors: corrupt_data.
template <typename Source>
Status code_positions(LevelState& state, Surface& surface, std::uint32_t first, std::uint32_t end,
                      std::size_t later_passes, Source& source) {
  const std::size_t stage = std::min(later_passes, kEarliestPass);
  const std::int32_t most = state.lattice.max_index() >> state.shift;
  Repetition& repetition = state.models.position.repetition;
  RingWalk<> rings(state.mesh, surface, first, end);
  for (std::uint32_t v = first; v < end; ++v) {
    const Ring& ring = rings.next();
    const Expectation expected = state.predictor.expect(ring, surface, v, state.shift, stage);
    LatticePoint cell{};
    if (source.failed() || !code_position(state.models.position, source, surface, ring, expected, most, state.shift,
                                          nullptr, 0, cell_of(source.wanted_point(v), state.shift), cell)) {
      return Error{ErrorCode::corrupt_data, v, "the packet's geometry leaves the lattice"};
    }
    settle(state, surface, ring, expected, v, middle_of(cell, state.shift));
    if (repetition.reflection.any()) repetition.images.add(state.points[v]);
  }
  return {};
}

/// Further digits of the positions of the vertices before `end`, which lack `shift` digits, down to the level's shift.
/// Errors: corrupt_data.
template <typename Source>
Status code_digits(LevelState& state, Surface& surface, unsigned shift, std::uint32_t end, Source& source) {
  const std::int32_t most = state.lattice.max_index() >> state.shift;
  RingWalk<> rings(state.mesh, surface, 0, end);
  for (std::uint32_t v = 0; v < end; ++v) {
    const Ring& ring = rings.next();
    if (ring.size == 0) continue;  // isolated: it came with all digits
    if (source.failed()) return Error{ErrorCode::corrupt_data, v, "the packet's digits end too early"};
    const Expectation expected = state.predictor.expect(ring, surface, v, state.shift, kFurtherDigits);
    const LatticePoint known = cell_of_middle(state.points[v], shift);
    LatticePoint cell{};
    code_position(state.models.position, source, surface, ring, expected, most, state.shift, &known,
                  shift - state.shift, cell_of(source.wanted_point(v), state.shift), cell);
    settle(state, surface, ring, expected, v, middle_of(cell, state.shift));
  }
  return {};
}

/// A pass may cost next to no bits but costs a walk over the mesh: so their number is bounded, and each must insert.
inline constexpr std::uint32_t kMaxPasses = 1024;

/// A refinement packet: its passes, coarse to fine; `shift`: digits that positions lack after it. Errors: corrupt_data.
template <typename Source>
Status code_passes(LevelState& state, const LevelBounds& bounds, unsigned shift, Source& source) {
  const unsigned old_shift = state.shift;
  const std::uint32_t old_count = state.mesh.vertex_count();
  state.shift = shift;
  if (shift > old_shift || old_shift - shift > CoordinateModel::kMostDigits) {
    return Error{ErrorCode::corrupt_data, shift, "digits of positions can only be added, a few at a time"};
  }
  const auto guessing = static_cast<Guessing>(source.raw(static_cast<std::uint32_t>(source.wanted_guessing()), 1));
  const float clear = static_cast<float>(source.raw(source.wanted_clear(), 3)) / kNoneClear;
  state.models.symbol.set_clear(clear);
  state.models.clean.set_clear(clear);
  const std::uint32_t passes = source.raw(source.wanted_passes(), 11);
  if (passes > kMaxPasses) return Error{ErrorCode::corrupt_data, passes, "a packet with more passes than any needs"};

  Marks marks;
  Surface surface;
  const std::int32_t most = 2 * state.lattice.max_index();
  std::vector<std::uint32_t> pass_end;
  for (std::uint32_t pass = 0; pass < passes; ++pass) {
    source.told_pass(pass);
    const std::uint32_t kind = source.raw(static_cast<std::uint32_t>(source.wanted_pass_kind()), 2);
    if (kind > static_cast<std::uint32_t>(PassKind::ears)) {
      return Error{ErrorCode::corrupt_data, pass, "an unknown kind of pass"};
    }
    const std::uint32_t first = state.mesh.vertex_count();
    Status status = code_connectivity(state, marks, static_cast<PassKind>(kind), bounds, source);
    if (!status) return status;
    pass_end.push_back(state.mesh.vertex_count());
    if (guessing == Guessing::never || pass + 1 == passes) continue;
    surface.build(state.mesh, state.points, state.spreads);
    place_provisionally(state.mesh, surface, first, most);
    for (std::uint32_t v = first; v < state.mesh.vertex_count(); ++v) state.points[v] = surface[v].point;
  }
  source.told_part(PacketPart::connectivity);
  marks = Marks();  // its memory is wanted elsewhere
  if (passes == 0 && state.shift == old_shift) return {};

  surface.build(state.mesh, state.points, state.spreads);
  state.spreads.resize(state.points.size());
  Repetition& repetition = state.models.position.repetition;
  if (repetition.reflection.any()) {
    repetition.images.begin(repetition.reflection, state.points.size(), most);
    for (std::uint32_t v = 0; v < old_count; ++v) repetition.images.add(state.points[v]);
  }
  std::uint32_t first = old_count;
  for (std::size_t pass = 0; pass < pass_end.size(); ++pass) {
    if (guessing == Guessing::often) {
      place_provisionally(state.mesh, surface, first, most);
      surface.build_normals(state.mesh);
    }
    Status status = code_positions(state, surface, first, pass_end[pass], pass_end.size() - 1 - pass, source);
    if (!status) return status;
    first = pass_end[pass];
  }
  source.told_part(PacketPart::geometry);

  if (state.shift == old_shift) return {};
  Status status = code_digits(state, surface, old_shift, old_count, source);
  source.told_part(PacketPart::precision);
  return status;
}

}  // namespace pmcd::codec
