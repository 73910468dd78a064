// SPDX-License-Identifier: MIT
// From one level to the next: the packet's passes, each with all its connectivity first and then its geometry, with the
// refined connectivity known. The decoder reads through these functions, the encoder writes through them. They check
// what a packet can get wrong; they do not look at headers.
#pragma once

#include <array>
#include <cmath>
#include <utility>

#include "codec/conquest/conquest.h"
#include "codec/conquest/ears.h"
#include "codec/level_state.h"
#include "codec/result.h"
#include "codec/source.h"

namespace pmcd::codec {

/// Counts that a pass may not exceed: what the packet's header promised and the decoder's limits allowed.
struct LevelBounds {
  std::uint32_t vertices = 0;
  std::uint32_t faces = 0;
};

/// The conquest's driver on the decoder's side: opens patches and inserts vertices at provisional positions.
template <typename Source>
class InsertingDriver {
 public:
  InsertingDriver(LevelState& state, Marks& marks, PassKind kind, const LevelBounds& bounds, Source& source)
      : state_(state),
        marks_(marks),
        kind_(kind),
        bounds_(bounds),
        source_(source),
        surroundings_(state.mesh, state.points, kind, state.models.symbol.begin_pass(state.mesh.vertex_count())) {}

  void step_over(std::uint32_t gate) { surroundings_.keep(state_.mesh, gate); }

  Symbol decide(std::uint32_t gate, Tag tag_s, Tag tag_t, Patch& patch) {
    if (source_.failed()) return kImpossible;
    const Symbol wanted = source_.wanted_symbol();
    HalfEdgeMesh& mesh = state_.mesh;
    SymbolModel& model = kind_ == PassKind::cleaning ? state_.models.clean : state_.models.symbol;
    const std::span<const Hypothesis> hypotheses = surroundings_.look(mesh, marks_, gate, tag_s, tag_t);
    const Hypothesis& holds = model.code(source_, mesh, marks_, gate, tag_s, tag_t, hypotheses, wanted);
    const Symbol symbol = holds.symbol;
    if (symbol == kNull) {
      surroundings_.keep(mesh, gate);
      return symbol;
    }
    patch = holds.patch;
    if (mesh.vertex_count() >= bounds_.vertices ||
        mesh.face_count() + 2 > bounds_.faces + (patch.is_border() ? 1 : 0)) {
      return kImpossible;
    }
    const Triangulation& triangulation = kind_ == PassKind::cleaning ? interior_triangulation(3, Tag::plus, Tag::minus)
                                         : patch.is_border() ? border_triangulation(patch.size, patch.closing, tag_t)
                                                             : interior_triangulation(patch.size, tag_s, tag_t);
    std::array<std::int64_t, 3> sum{};
    for (std::uint32_t v : patch.ring_vertices()) {
      for (std::size_t axis = 0; axis < 3; ++axis) sum[axis] += state_.points[v][axis];
    }
    LatticePoint provisional{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      provisional[axis] = static_cast<std::int32_t>((2 * sum[axis] + patch.size) / (2 * patch.size));
    }
    const std::uint32_t vertex = mesh.add_vertex();
    state_.points.push_back(provisional);
    insert_centre(mesh, patch, triangulation, vertex);
    surroundings_.insert(holds, triangulation, provisional);
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

/// The three coordinates of one vertex, one after the other: the expected covariance is an ellipsoid about the normal,
/// and each coordinate is expected given those before it (conditional Gaussian). The axis along which the normal is
/// longest comes last. False: the packet is damaged.
template <typename Source>
bool code_position(ResidualModel& model, Source& source, const Expectation& expected, std::int32_t most,
                   const LatticePoint& wanted, LatticePoint& point) {
  const Vec& n = expected.normal;
  std::array<std::size_t, 3> axis = {0, 1, 2};
  auto longer = [&](std::size_t i, std::size_t j) { return n[i] * n[i] > n[j] * n[j]; };
  if (longer(axis[0], axis[1])) std::swap(axis[0], axis[1]);
  if (longer(axis[1], axis[2])) std::swap(axis[1], axis[2]);
  if (longer(axis[0], axis[1])) std::swap(axis[0], axis[1]);

  const double t = expected.tangential * expected.tangential;
  const double difference = expected.across * expected.across - t;
  auto covariance = [&](std::size_t i, std::size_t j) {
    return difference * n[axis[i]] * n[axis[j]] + (i == j ? t : 0);
  };
  std::array<std::array<double, 3>, 3> factor{};
  std::array<double, 3> z{};
  constexpr double kLeastVariance = 1e-3;
  for (std::size_t i = 0; i < 3; ++i) {
    double mean = expected.position[axis[i]];
    double variance = covariance(i, i);
    for (std::size_t j = 0; j < i; ++j) {
      double sum = covariance(i, j);
      for (std::size_t k = 0; k < j; ++k) sum -= factor[i][k] * factor[j][k];
      factor[i][j] = sum / factor[j][j];
      variance -= factor[i][j] * factor[i][j];
      mean += factor[i][j] * z[j];
    }
    if (!(variance > kLeastVariance)) variance = kLeastVariance;
    factor[i][i] = std::sqrt(variance);
    if (!(mean > 0)) mean = 0;
    if (mean > most) mean = most;
    const std::int32_t value = model.code(source, wanted[axis[i]], mean, factor[i][i], most);
    if (value < 0) return false;
    point[axis[i]] = value;
    z[i] = (value - mean) / factor[i][i];
  }
  return true;
}

/// The inserting side of an ear pass (conquest/ears.h). False: the packet is damaged. [linear in the half-edges]
template <typename Source>
bool insert_ears(LevelState& state, const LevelBounds& bounds, Source& source) {
  HalfEdgeMesh& mesh = state.mesh;
  const std::uint32_t halfedges = 3 * mesh.face_count();
  for (std::uint32_t h = 0; h < halfedges; ++h) {
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

/// One pass. Errors: corrupt_data.
template <typename Source>
Status code_pass(LevelState& state, Marks& marks, PassKind kind, const LevelBounds& bounds, Source& source) {
  const std::uint32_t before = state.mesh.vertex_count();
  InsertingDriver<Source> driver(state, marks, kind, bounds, source);
  const bool walked = kind == PassKind::ears ? insert_ears(state, bounds, source)
                                             : conquer(state.mesh, state.seeds, kind, marks, driver);
  if (!walked) {
    return Error{ErrorCode::corrupt_data, before, "the packet's connectivity contradicts itself"};
  }
  source.told_part(PacketPart::connectivity);
  const std::uint32_t after = state.mesh.vertex_count();
  if (after == before) return Error{ErrorCode::corrupt_data, before, "a pass that inserts nothing"};
  state.predictor.resize(after);
  for (std::uint32_t v = before; v < after; ++v) {
    const Expectation expected = state.predictor.expect(state.mesh, state.points, v);
    LatticePoint point{};
    if (source.failed() || !code_position(state.models.residual, source, expected, state.lattice.max_index(),
                                          source.wanted_point(v), point)) {
      return Error{ErrorCode::corrupt_data, v, "the packet's geometry leaves the lattice"};
    }
    state.points[v] = point;
    state.predictor.learn(expected, v, point);
  }
  source.told_part(PacketPart::geometry);
  return {};
}

/// A pass may cost next to no bits but costs a walk over the mesh: so their number is bounded, and each must insert.
inline constexpr std::uint32_t kMaxPasses = 1024;

/// The passes of a refinement packet, coarse to fine. Errors: corrupt_data.
template <typename Source>
Status code_passes(LevelState& state, const LevelBounds& bounds, Source& source) {
  Marks marks;
  const std::uint32_t passes = source.raw(source.wanted_passes(), 16);
  if (passes > kMaxPasses) return Error{ErrorCode::corrupt_data, passes, "a packet with more passes than any needs"};
  for (std::uint32_t pass = 0; pass < passes; ++pass) {
    source.told_pass(pass);
    const std::uint32_t kind = source.raw(static_cast<std::uint32_t>(source.wanted_pass_kind()), 2);
    if (kind > static_cast<std::uint32_t>(PassKind::ears)) {
      return Error{ErrorCode::corrupt_data, pass, "an unknown kind of pass"};
    }
    Status status = code_pass(state, marks, static_cast<PassKind>(kind), bounds, source);
    if (!status) return status;
  }
  return {};
}

}  // namespace pmcd::codec
