// SPDX-License-Identifier: MIT
// The base mesh as one region that grows face by face from each component's first face, connectivity and positions
// together: the positions known so far tell what most likely lies beyond an open half-edge, and where. A single-rate
// coder that serves a dozen vertices as well as some thousand. Both directions in one text, as in refine.h.
#pragma once

#include <algorithm>
#include <array>
#include <vector>

#include "codec/base/alphabet.h"
#include "codec/base/front.h"
#include "codec/base/gate_queue.h"
#include "codec/base/outlook.h"
#include "codec/base/position_model.h"
#include "codec/base/step_model.h"
#include "codec/level_state.h"
#include "codec/result.h"
#include "codec/source.h"

namespace pmcd::codec {

template <typename Source>
class BaseCoder {
 public:
  BaseCoder(LevelState& state, Source& source, std::uint32_t max_vertices, std::uint32_t max_faces, unsigned shift)
      : state_(state),
        source_(source),
        max_vertices_(max_vertices),
        max_faces_(max_faces),
        shift_(shift),
        most_(static_cast<std::int32_t>(static_cast<std::uint32_t>(state.lattice.max_index()) >> shift)) {}

  Status code() {
    const std::uint32_t components = UnsignedModel().code(source_, source_.wanted_components());
    if (components > max_faces_) return corrupt();
    if (components > 0) has_boundary_ = source_.raw(source_.wanted_boundary() ? 1 : 0, 1) != 0;
    for (std::size_t axis = 0; axis < 3 && components > 0; ++axis) {
      alphabets_[axis] = Alphabet(most_);
      const std::vector<std::int32_t> wanted = source_.wanted_values(axis, shift_);
      if (!alphabets_[axis].code(source_, wanted, max_vertices_)) return corrupt();
    }
    start_ = {most_ / 2, most_ / 2, most_ / 2};
    for (std::uint32_t component = 0; component < components; ++component) {
      if (!code_component(component)) return corrupt();
    }
    Result<HalfEdgeMesh> mesh = HalfEdgeMesh::build(front_.faces(), front_.vertex_count());
    if (!mesh) return Error{ErrorCode::corrupt_data, 0, "the base mesh is not a manifold: " + mesh.error().detail};
    state_.mesh = std::move(mesh).value();
    state_.points.reserve(cells_.size());
    for (const LatticePoint& cell : cells_) state_.points.push_back(middle_of(cell, shift_));
    state_.shift = shift_;
    state_.spreads.resize(cells_.size());
    source_.told_part(PacketPart::base);
    return {};
  }

 private:
  static Error corrupt() { return Error{ErrorCode::corrupt_data, 0, "the base mesh contradicts itself"}; }

  bool code_component(std::uint32_t component) {
    const std::uint32_t first = front_.vertex_count();
    if (front_.face_count() == max_faces_ || max_vertices_ - first < 3 || first > max_vertices_ || source_.failed())
      return false;
    for (int i = 0; i < 3; ++i) front_.add_vertex();
    const std::uint32_t face = front_.add_first_face(first, first + 1, first + 2);
    source_.told_component(component, first, face);
    if (!code_start(first)) return false;
    vicinity_.add_face(front_.faces()[face], cells_);
    for (std::uint32_t h = 3 * face; h < 3 * face + 3; ++h) queue(h);
    while (!gates_.empty()) {
      const std::uint32_t gate = gates_.pop();
      if (front_.is_open(gate) && !grow(gate)) return false;
    }
    state_.seeds.push_back({first, first + 1});
    return true;
  }

  // The first three vertices: the first against that of the component before, the others against each other.
  bool code_start(std::uint32_t first) {
    auto add = [&](const LatticePoint& from, double spread) {
      const LatticePoint wanted = wanted_cell(static_cast<std::uint32_t>(cells_.size()));
      LatticePoint cell{};
      if (!positions_.code_start(source_, alphabets_, from, spread, wanted, cell)) return false;
      cells_.push_back(cell);
      return true;
    };
    auto mean_distance = [](const LatticePoint& a, const LatticePoint& b) {
      return length(to_vec(a) - to_vec(b)) * 0.5;
    };
    if (!add(start_, jump_)) return false;
    const LatticePoint a = cells_[first];
    jump_ = std::max(0.5, first == 0 ? most_ * 0.25 : jump_ * 0.8 + mean_distance(a, start_) * 0.2);
    start_ = a;
    if (!add(a, edge_)) return false;
    const LatticePoint b = cells_[first + 1];
    const double edge = std::max(0.5, mean_distance(a, b));
    edge_ = first == 0 ? edge : edge_ * 0.7 + edge * 0.3;
    return add({(a[0] + b[0]) / 2, (a[1] + b[1]) / 2, (a[2] + b[2]) / 2}, edge);
  }

  bool grow(std::uint32_t gate) {
    const Outlook outlook = vicinity_.look(front_, cells_, gate);
    StepModel::Step step;
    const StepModel::Step wanted = wanted_step(gate);
    if (!steps_.code(source_, front_, cells_, outlook, gate, has_boundary_, wanted, step)) return false;
    if (step.kind == BaseStep::Kind::boundary) {
      const std::uint32_t before = front_.before(gate);
      const std::uint32_t after = front_.after(gate);
      front_.end_at_boundary(gate);
      queue(before);
      queue(after);
      return true;
    }
    if (front_.face_count() == max_faces_ || front_.tangled() || source_.failed()) return false;
    std::uint32_t vertex = 0;
    if (step.kind == BaseStep::Kind::new_vertex) {
      if (front_.vertex_count() == max_vertices_) return false;
      vertex = front_.add_vertex();
    } else {
      vertex = front_.origin(step.entry);
      if (vertex == front_.origin(gate) || vertex == front_.target(gate)) return false;
    }
    const std::uint32_t before = front_.before(gate);
    const std::uint32_t after = front_.after(gate);
    const std::uint32_t arriving = step.entry == kNone ? kNone : front_.before(step.entry);
    const std::uint32_t face = front_.attach(gate, step.entry, vertex);
    source_.told_face(gate, face, vertex);
    if (step.kind == BaseStep::Kind::new_vertex && !code_new(vertex, outlook)) return false;
    vicinity_.add_face(front_.faces()[face], cells_);
    // Whoever lies beside a gap that changed.
    for (const std::uint32_t h : {before, after, step.entry, arriving, 3 * face + 1, 3 * face + 2}) {
      if (h != kNone) queue(h);
    }
    return true;
  }

  // In the words of this side: the writer knows half-edges by their neighbours only.
  StepModel::Step wanted_step(std::uint32_t gate) {
    const BaseStep wanted = source_.wanted_beyond(gate);
    std::uint32_t entry = wanted.halfedge;
    if (entry != kNone && wanted.arrives) entry = front_.after(entry);
    return {wanted.kind, entry};
  }

  bool code_new(std::uint32_t vertex, const Outlook& outlook) {
    LatticePoint cell{};
    if (!positions_.code_new(source_, alphabets_, outlook, wanted_cell(vertex), cell)) return false;
    cells_.push_back(cell);
    vicinity_.learn(outlook, cell);
    return true;
  }

  LatticePoint wanted_cell(std::uint32_t vertex) {
    LatticePoint cell = source_.wanted_point(vertex);
    for (std::int32_t& c : cell) c >>= shift_;
    return cell;
  }

  void queue(std::uint32_t h) {
    if (front_.is_open(h)) gates_.push(vicinity_.urgency(front_, cells_, h), h);
  }

  LevelState& state_;
  Source& source_;
  std::uint32_t max_vertices_;
  std::uint32_t max_faces_;
  unsigned shift_;
  std::int32_t most_;
  bool has_boundary_ = false;

  Front front_;
  std::vector<LatticePoint> cells_;  // by vertex
  Vicinity vicinity_;
  GateQueue gates_;
  LatticePoint start_{};
  double jump_ = most_ * 0.25 + 0.5;
  double edge_ = most_ * 0.125 + 0.5;
  StepModel steps_;
  std::array<Alphabet, 3> alphabets_;
  PositionModel positions_;
};

/// Codes the base mesh into (reading) or out of (writing) an empty state whose lattice is set; at most `max_vertices`
/// and `max_faces` are accepted. Positions are those of cells of 2^shift lattice steps (their middle).
/// The first half-edge of a component's first face becomes its seed. REQUIRES: shift <= 20.
/// Errors: corrupt_data, and build()'s errors as corrupt_data. [n log n; a search of at most 2^24 steps]
template <typename Source>
Status code_base_mesh(LevelState& state, Source& source, std::uint32_t max_vertices, std::uint32_t max_faces,
                      unsigned shift) {
  return BaseCoder<Source>(state, source, max_vertices, max_faces, shift).code();
}

/// The coded part of a base packet up to its mesh: what the whole mesh is like, and the mesh, whose positions lack
/// `shift` digits. Errors: corrupt_data.
template <typename Source>
Status code_base_level(LevelState& state, Source& source, std::uint32_t max_vertices, std::uint32_t max_faces,
                       unsigned shift) {
  if (shift >= state.lattice.bits) return Error{ErrorCode::corrupt_data, shift, "a level without a digit"};
  const std::uint32_t structure = source.raw(static_cast<std::uint32_t>(source.wanted_structure()), 2);
  if (structure > static_cast<std::uint32_t>(Structure::all)) {
    return Error{ErrorCode::corrupt_data, structure, "an unknown kind of structure"};
  }
  state.models.position.repetition.structure = static_cast<Structure>(structure);
  const Reflection wanted = source.wanted_reflection();
  Reflection& reflection = state.models.position.repetition.reflection;
  if (source.raw(wanted.any() ? 1 : 0, 1) != 0) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      reflection.flips[axis] = source.raw(wanted.flips[axis] ? 1 : 0, 1) != 0;
      if (!reflection.flips[axis]) continue;
      const std::uint32_t steps = source.raw(static_cast<std::uint32_t>(wanted.sum[axis]) / 2, 25);
      reflection.sum[axis] = 2 * static_cast<std::int32_t>(steps);
    }
  }
  return code_base_mesh(state, source, max_vertices, max_faces, shift);
}

}  // namespace pmcd::codec
