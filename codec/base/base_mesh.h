// SPDX-License-Identifier: MIT
// The base mesh as one region that grows face by face from each component's first face: beyond an open edge lies the
// boundary, a new vertex or a known one. Connectivity of everything first, then positions along the same order. A plain
// single-rate coder for some dozen vertices (in the family of Gumhold and Strasser's cut-border machine, 1998); it does
// not aim at large meshes.
#pragma once

#include <algorithm>
#include <array>
#include <vector>

#include "codec/entropy/integer_model.h"
#include "codec/level_state.h"
#include "codec/result.h"
#include "codec/source.h"

namespace pmcd::codec {

/// Codes the base mesh into (reading) or out of (writing) an empty state whose lattice is set; at most `max_vertices`
/// and `max_faces` are accepted. The first half-edge of a component's first face becomes its seed.
/// Errors: corrupt_data, and build()'s errors as corrupt_data.
template <typename Source>
Status code_base_mesh(LevelState& state, Source& source, std::uint32_t max_vertices, std::uint32_t max_faces) {
  struct Reference {  // of a vertex: the gate and apex from which its position is predicted
    std::uint32_t a;
    std::uint32_t b;
    std::uint32_t apex;
  };
  const Error corrupt{ErrorCode::corrupt_data, 0, "the base mesh contradicts itself"};

  std::vector<Face> faces;
  std::vector<std::uint8_t> closed;       // by half-edge: has its opposite, or is boundary
  std::vector<std::uint32_t> first_open;  // by vertex: head of the list of open half-edges that leave it
  std::vector<std::uint32_t> next_open;   // by half-edge
  std::uint64_t steps = 0;                // over open half-edges in search of another
  std::vector<Reference> reference;       // by vertex
  std::vector<std::uint32_t> queue;
  AdaptiveBit is_boundary;
  AdaptiveBit is_new;

  auto add_vertex = [&](const Reference& from) {
    reference.push_back(from);
    first_open.push_back(kNone);
    return static_cast<std::uint32_t>(reference.size() - 1);
  };
  auto origin = [&](std::uint32_t h) { return faces[h / 3][h % 3]; };
  auto target = [&](std::uint32_t h) { return faces[h / 3][(h + 1) % 3]; };
  // Closes h against the open half-edge that runs the other way, if there is one; else h is open itself.
  auto close_or_open = [&](std::uint32_t h) {
    std::uint32_t* link = &first_open[target(h)];
    while (*link != kNone) {
      const std::uint32_t g = *link;
      if (closed[g] != 0) {  // turned out to be boundary
        *link = next_open[g];
        continue;
      }
      if (target(g) == origin(h)) {
        closed[g] = closed[h] = 1;
        *link = next_open[g];
        return;
      }
      link = &next_open[g];
      ++steps;
    }
    next_open[h] = first_open[origin(h)];
    first_open[origin(h)] = h;
    queue.push_back(h);
  };
  auto add_face = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    const auto face = static_cast<std::uint32_t>(faces.size());
    faces.push_back({a, b, c});
    closed.resize(closed.size() + 3, 0);
    next_open.resize(next_open.size() + 3, kNone);
    for (std::uint32_t h = 3 * face; h < 3 * face + 3; ++h) close_or_open(h);
    return face;
  };

  state.shift = source.raw(source.wanted_shift(), 5);
  state.models.position.structured = source.raw(source.wanted_structured() ? 1 : 0, 1) != 0;
  if (state.shift >= state.lattice.bits) return corrupt;
  const std::uint32_t components = source.raw(source.wanted_components(), 32);
  if (components > max_faces) return corrupt;
  for (std::uint32_t component = 0; component < components; ++component) {
    const auto first = static_cast<std::uint32_t>(reference.size());
    if (faces.size() == max_faces || max_vertices - first < 3 || first > max_vertices || source.failed())
      return corrupt;
    add_vertex({kNone, kNone, kNone});
    add_vertex({first, first, first});
    add_vertex({first, first + 1, kNone});
    queue.clear();
    const std::uint32_t face = add_face(first, first + 1, first + 2);
    source.told_component(component, first, face);
    for (std::size_t head = 0; head < queue.size(); ++head) {
      const std::uint32_t h = queue[head];
      if (closed[h] != 0) continue;
      const BaseStep wanted = source.wanted_beyond(h);
      if (source.bit(is_boundary, wanted.kind == BaseStep::Kind::boundary)) {
        closed[h] = 1;
        continue;
      }
      // Only a forger piles up open edges at one vertex, to make the search for them long.
      const bool tangled = steps > 1000 + 64 * std::uint64_t{faces.size()};
      if (faces.size() == max_faces || tangled || source.failed()) return corrupt;
      std::uint32_t vertex = 0;
      const auto known = static_cast<std::uint32_t>(reference.size()) - first;
      if (source.bit(is_new, wanted.kind == BaseStep::Kind::new_vertex)) {
        if (reference.size() == max_vertices) return corrupt;
        vertex = add_vertex({origin(h), target(h), faces[h / 3][(h + 2) % 3]});
      } else {
        unsigned bits = 0;
        while ((std::uint64_t{1} << bits) < known) ++bits;
        vertex = first + source.raw(wanted.vertex - first, bits);
        if (vertex - first >= known || vertex == origin(h) || vertex == target(h)) return corrupt;
      }
      const std::uint32_t added = add_face(target(h), origin(h), vertex);
      source.told_face(h, added, vertex);
    }
    state.seeds.push_back({first, first + 1});
  }
  const auto count = static_cast<std::uint32_t>(reference.size());
  Result<HalfEdgeMesh> mesh = HalfEdgeMesh::build(faces, count);
  if (!mesh) return Error{ErrorCode::corrupt_data, 0, "the base mesh is not a manifold: " + mesh.error().detail};
  state.mesh = std::move(mesh).value();

  std::array<SignedModel, 3> start_model;  // first vertices of components, against the one before
  std::array<SignedModel, 3> step_model;   // all others, against the parallelogram, drawn in by half
  state.points.reserve(count);
  const std::int32_t most = state.lattice.max_index() >> state.shift;
  LatticePoint start{most / 2, most / 2, most / 2};
  for (std::uint32_t v = 0; v < count; ++v) {
    const Reference& from = reference[v];
    const LatticePoint wanted = cell_of(source.wanted_point(v), state.shift);
    LatticePoint point{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      std::int32_t guess = start[axis];
      if (from.a != kNone) {
        const std::int32_t a = state.points[from.a][axis];
        const std::int32_t b = state.points[from.b][axis];
        const std::int32_t twice_apex = from.apex == kNone ? a + b : 2 * state.points[from.apex][axis];
        guess = std::clamp((3 * (a + b) - twice_apex) / 4, 0, most);
      }
      SignedModel& model = from.a == kNone ? start_model[axis] : step_model[axis];
      const std::int64_t value = std::int64_t{guess} + model.code(source, wanted[axis] - guess);
      if (value < 0 || value > most) return corrupt;
      point[axis] = static_cast<std::int32_t>(value);
    }
    if (from.a == kNone) start = point;
    state.points.push_back(point);
  }
  for (LatticePoint& point : state.points) point = middle_of(point, state.shift);
  state.surface.build(state.mesh, state.points);
  source.told_part(PacketPart::base);
  return {};
}

}  // namespace pmcd::codec
