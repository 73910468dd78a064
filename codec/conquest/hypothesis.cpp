// SPDX-License-Identifier: MIT
// Everything here steers decoding: single precision, + - * / and sqrt only, every quotient and logarithm guarded.
#include "codec/conquest/hypothesis.h"

#include <algorithm>
#include <cmath>

namespace pmcd::codec {
namespace {

struct Vec3 {
  float x = 0;
  float y = 0;
  float z = 0;
};

Vec3 between(const LatticePoint& from, const LatticePoint& to) {
  return {static_cast<float>(to[0] - from[0]), static_cast<float>(to[1] - from[1]),
          static_cast<float>(to[2] - from[2])};
}

float squared(const Vec3& a) {
  return a.x * a.x + a.y * a.y + a.z * a.z;
}

constexpr float kLeast = 0.05f;  // lattice units; lengths below it are no lengths

// From the corner that a parallelogram over (0, b) against w expects to where it is.
Vec3 kite_offset(const Vec3& b, const Vec3& w, const Vec3& actual) {
  return {actual.x - b.x + w.x, actual.y - b.y + w.y, actual.z - b.z + w.z};
}

float guarded_log2(float x) {
  return fast_log2(std::max(x, kLeast));
}

float bounded(float x) {
  return std::clamp(x, -4.0f, 4.0f);
}

}  // namespace

Surroundings::Surroundings(const HalfEdgeMesh& mesh, std::span<const LatticePoint> points, PassKind kind,
                           std::uint32_t previous)
    : kind_(kind), previous_(previous) {
  if (kind == PassKind::ears) return;
  const std::uint32_t faces = mesh.face_count();
  face_.resize(faces);
  length_.resize(3 * std::size_t{faces});
  vertex_.resize(mesh.vertex_count());
  for (std::uint32_t f = 0; f < faces; ++f) {
    const Face corners = mesh.face(f);
    const LatticePoint& a = points[corners[0]];
    const LatticePoint& b = points[corners[1]];
    const LatticePoint& c = points[corners[2]];
    const Vec3 ab = between(a, b);
    const Vec3 ac = between(a, c);
    const Vec3 normal{ab.y * ac.z - ab.z * ac.y, ab.z * ac.x - ab.x * ac.z, ab.x * ac.y - ab.y * ac.x};
    face_[f] = {normal.x, normal.y, normal.z, std::sqrt(squared(normal))};
    length_[3 * f] = std::sqrt(squared(ab));
    length_[3 * f + 1] = std::sqrt(squared(between(b, c)));
    length_[3 * f + 2] = std::sqrt(squared(ac));
    for (std::size_t i = 0; i < 3; ++i) {
      ++vertex_[corners[i]].open;
      has_boundary_ = has_boundary_ || mesh.opposite(3 * f + static_cast<std::uint32_t>(i)) == kNone;
    }
  }
}

std::uint8_t Surroundings::state_of(const HalfEdgeMesh& mesh, std::uint32_t v, unsigned closed, int change) const {
  const std::uint32_t open = vertex_[v].open > closed ? vertex_[v].open - closed : 0;
  int valence = static_cast<int>(std::min<std::uint32_t>(mesh.face_valence(v), 100)) + change;
  if (has_boundary_ && mesh.is_boundary(v)) valence += 3;
  return static_cast<std::uint8_t>(std::min<std::uint32_t>(open, 3) * 10 +
                                   static_cast<std::uint32_t>(std::clamp(valence, 2, 11) - 2));
}

void Surroundings::describe_null(const HalfEdgeMesh& mesh, std::span<const LatticePoint> points, const Marks& marks,
                                 std::uint32_t gate, const Scale& scale, Hypothesis& h) const {
  const std::uint32_t t = mesh.target(gate);
  const std::uint32_t s = mesh.origin(gate);
  const std::uint32_t front = mesh.apex(gate);
  h.symbol = kNull;
  h.row = 0;
  h.vertices = 3;
  h.state = {state_of(mesh, t, 1, 0), state_of(mesh, front, 1, 0), state_of(mesh, s, 1, 0)};
  // Where a parallelogram over a refined neighbour expects the third corner, against where it is.
  const float unit = 1.0f / std::max(scale.edge, kLeast);
  auto kite = [&](std::uint32_t inner) {
    const std::uint32_t across = mesh.opposite(inner);
    const LatticePoint& a = points[mesh.origin(inner)];
    return 0.5f *
           fast_log2(squared(kite_offset(between(a, points[mesh.target(inner)]), between(a, points[mesh.apex(across)]),
                                         between(a, points[mesh.apex(inner)]))) *
                         unit * unit +
                     0.003f);
  };
  const float kite_gate = mesh.opposite(gate) == kNone ? 0.0f : bounded(kite(gate));
  float kites = 0;
  float kite_count = 0;
  for (std::uint32_t inner : {HalfEdgeMesh::next(gate), HalfEdgeMesh::prev(gate)}) {
    const std::uint32_t across = mesh.opposite(inner);
    if (across == kNone || marks.face[HalfEdgeMesh::face_of(across)] == 0) continue;
    kites += bounded(kite(inner));
    kite_count += 1;
  }
  if (kite_count > 0) kites /= kite_count;
  auto recent = [&](std::uint32_t v) { return v >= previous_ ? 1.0f : 0.0f; };
  const VertexSums& at_s = vertex_[s];
  const VertexSums& at_t = vertex_[t];
  auto few = [](std::uint32_t n) { return 0.2f * static_cast<float>(std::min<std::uint32_t>(n, 16)); };
  const float next = guarded_log2(length_[HalfEdgeMesh::next(gate)]);
  const float prev = guarded_log2(length_[HalfEdgeMesh::prev(gate)]);
  const float own = guarded_log2(length_[gate]);
  h.input.value = {bounded(guarded_log2(face_[HalfEdgeMesh::face_of(gate)].area) - scale.log_area),
                   bounded(next - scale.log_edge) + bounded(prev - scale.log_edge),
                   few(mesh.face_valence(front)) - 1.2f,
                   few(vertex_[front].open),
                   few(vertex_[s].open + vertex_[t].open),
                   recent(front),
                   std::max(next, prev) - own,
                   bounded(own - scale.log_edge),
                   few(mesh.face_valence(s)) + few(mesh.face_valence(t)) - 2.4f,
                   bounded(next - scale.log_edge) - bounded(prev - scale.log_edge),
                   kite_gate,
                   kites,
                   recent(s) + recent(t),
                   bounded(guarded_log2(at_s.area / std::max(at_s.faces, 1.0f)) - scale.log_area),
                   bounded(guarded_log2(at_t.area / std::max(at_t.faces, 1.0f)) - scale.log_area),
                   0.0f};
}

void Surroundings::describe_patch(const HalfEdgeMesh& mesh, std::span<const LatticePoint> points, const Marks& marks,
                                  const Triangulation& triangulation, const Scale& scale, Hypothesis& h) const {
  const Patch& patch = h.patch;
  const unsigned size = patch.size;
  const float share = 1.0f / static_cast<float>(size);
  FaceShape sum;
  float least_face = 1e30f;
  float most_face = 0;
  std::array<int, kMaxPatchSize> change{};
  for (unsigned i = 0; i < size; ++i) change[i] = 2;
  if (patch.is_border()) change[patch.closing] = change[patch.closing + 1] = 1;
  std::array<unsigned, kMaxPatchSize> closed{};
  for (unsigned k = 0; k < triangulation.triangles; ++k) {
    const FaceShape& face = face_[patch.slots[k]];
    least_face = std::min(least_face, face.area);
    most_face = std::max(most_face, face.area);
    sum = {sum.x + face.x, sum.y + face.y, sum.z + face.z, sum.area + face.area};
    for (std::uint8_t corner : triangulation.corner[k]) {
      --change[corner];
      ++closed[corner];
    }
  }
  const float flatness = std::sqrt(squared({sum.x, sum.y, sum.z})) / std::max(sum.area, kLeast);
  std::array<Vec3, kMaxPatchSize> ring;
  Vec3 mean;
  for (unsigned i = 0; i < size; ++i) {
    ring[i] = between(points[patch.ring[0]], points[patch.ring[i]]);
    mean = {mean.x + ring[i].x, mean.y + ring[i].y, mean.z + ring[i].z};
  }
  mean = {mean.x * share, mean.y * share, mean.z * share};
  float diagonals = 0;
  float diagonal_count = 0;
  for (unsigned k = 1; k < triangulation.triangles; ++k) {
    const auto& step = triangulation.step[k];
    const unsigned a = triangulation.corner[step.from_triangle][step.from_edge];
    const unsigned b = triangulation.corner[step.from_triangle][(step.from_edge + 1u) % 3];
    diagonals += squared({ring[a].x - ring[b].x, ring[a].y - ring[b].y, ring[a].z - ring[b].z});
    diagonal_count += 1;
  }
  float least = 1e30f;
  float most = 0;
  float spokes = 0;
  float border = 0;
  float longest = 0;
  float shortest = 1e30f;
  float ends = 0;
  float recent = 0;
  int regular = 0;
  for (unsigned i = 0; i < size; ++i) {
    const float d = squared({ring[i].x - mean.x, ring[i].y - mean.y, ring[i].z - mean.z});
    least = std::min(least, d);
    most = std::max(most, d);
    spokes += d;
    const float edge = length_[patch.inside[i]];
    border += edge;
    longest = std::max(longest, edge);
    shortest = std::min(shortest, edge);
    if (i == 0 || i + 1 == size) ends += d;
    const std::uint32_t v = patch.ring[i];
    recent += v >= previous_ ? 1.0f : 0.0f;
    const std::uint8_t state = state_of(mesh, v, closed[i], change[i]);
    h.state[i] = state;
    const int after = static_cast<int>(state % 10) + 2;
    regular += std::abs(after - 6) - std::abs(after - change[i] - 6);
  }
  h.vertices = static_cast<std::uint8_t>(size);
  const float unit = 1.0f / std::max(scale.edge, kLeast);
  float kite_gate = 0;
  float kites = 0;
  float kite_count = 0;
  for (unsigned i = 0; i < size; ++i) {
    const std::uint32_t across = patch.outside[i];
    if (across == kNone || marks.face[HalfEdgeMesh::face_of(across)] == 0) continue;
    const Vec3& a = ring[i];
    const Vec3& b = ring[i + 1 < size ? i + 1 : 0];
    const Vec3 w = between(points[patch.ring[0]], points[mesh.apex(across)]);
    const Vec3 off{mean.x - a.x - b.x + w.x, mean.y - a.y - b.y + w.y, mean.z - a.z - b.z + w.z};
    const float d = bounded(0.5f * fast_log2(squared(off) * unit * unit + 0.003f));
    if (i + 1 == size) kite_gate = d;
    kites += d;
    kite_count += 1;
  }
  if (kite_count > 0) kites /= kite_count;
  h.face_area = sum.area / static_cast<float>(patch.star_faces());
  h.spoke = std::sqrt(spokes * share);
  border *= share;
  h.input.value = {
      bounded(guarded_log2(h.face_area) - scale.log_area),
      0.3f * static_cast<float>(regular),
      0.2f * fast_log2(std::max(1.0f - flatness, 0.0f) + 0.002f),
      bounded(guarded_log2(border) - scale.log_edge),
      fast_log2(std::max(longest, kLeast) / std::max(border, kLeast)),
      recent * share,
      diagonal_count > 0 ? bounded(0.5f * guarded_log2(diagonals / diagonal_count) - scale.log_edge) : 0.0f,
      bounded(0.5f * guarded_log2(0.5f * ends) - scale.log_edge),
      fast_log2(std::max(shortest, kLeast) / std::max(border, kLeast)),
      bounded(0.5f * guarded_log2(most) - scale.log_edge),
      bounded(0.5f * guarded_log2(least) - scale.log_edge),
      kite_gate,
      kites,
      kite_count * share,
      bounded(guarded_log2(least_face) - scale.log_area),
      bounded(guarded_log2(most_face) - scale.log_area)};
}

std::span<Hypothesis> Surroundings::look(const HalfEdgeMesh& mesh, std::span<const LatticePoint> points,
                                         const Marks& marks, std::uint32_t gate, Tag tag_s, Tag tag_t) {
  const std::uint32_t s = mesh.origin(gate);
  const std::uint32_t t = mesh.target(gate);
  const std::uint32_t front = mesh.apex(gate);
  const VertexSums& at_s = vertex_[s];
  const VertexSums& at_t = vertex_[t];
  const VertexSums& at_front = vertex_[front];
  // A little of the whole pass steadies the local means and stands in for them at a seed.
  constexpr float kPrior = 0.5f;
  const float all_faces = std::max(all_.faces, 1.0f);
  const float prior_area = kPrior * all_.area / all_faces;
  const float prior_perimeter = kPrior * all_.perimeter / all_faces;
  const float faces = at_s.faces + at_t.faces;
  Scale scale;
  scale.log_area =
      guarded_log2((at_s.area + at_t.area + at_front.area + prior_area) / (faces + at_front.faces + kPrior));
  scale.edge = (at_s.perimeter + at_t.perimeter + prior_perimeter) / (3.0f * (faces + kPrior));
  scale.log_edge = guarded_log2(scale.edge);

  describe_null(mesh, points, marks, gate, scale, hypothesis_[0]);
  std::size_t count = 1;
  auto consider = [&](const Triangulation& triangulation, unsigned closing, Symbol symbol, std::size_t row) {
    Hypothesis& h = hypothesis_[count];
    if (!collect_polygon(mesh, gate, triangulation, closing, marks.face, h.patch)) return;
    h.symbol = symbol;
    h.row = static_cast<std::uint8_t>(row);
    describe_patch(mesh, points, marks, triangulation, scale, h);
    ++count;
  };
  if (kind_ == PassKind::cleaning) {
    consider(interior_triangulation(3, Tag::plus, Tag::minus), kNoClosing, 3, 1);
    return {hypothesis_.data(), count};
  }
  // A border patch takes in a boundary edge of at most two faces: then a vertex of the gate's face lies there.
  if (has_boundary_ && (mesh.is_boundary(s) || mesh.is_boundary(t) || mesh.is_boundary(front))) {
    for (unsigned size = 4; size >= 3; --size) {
      for (unsigned closing = 0; closing + 1 < size; ++closing) {
        const Symbol symbol = border_symbol(size, closing);
        consider(border_triangulation(size, closing, tag_t), closing, symbol, 5u + symbol - kBorder);
      }
    }
  }
  for (unsigned size = 6; size >= 3; --size) {
    consider(interior_triangulation(size, tag_s, tag_t), kNoClosing, static_cast<Symbol>(size), size - 2);
  }
  return {hypothesis_.data(), count};
}

void Surroundings::keep(const HalfEdgeMesh& mesh, std::uint32_t gate) {
  const std::uint32_t f = HalfEdgeMesh::face_of(gate);
  const float area = face_[f].area;
  const float perimeter = length_[3 * f] + length_[3 * f + 1] + length_[3 * f + 2];
  for (std::uint32_t v : mesh.face(f)) {
    add_face(vertex_[v], area, perimeter);
    --vertex_[v].open;
  }
  all_ = {all_.area * 0.98f, all_.perimeter * 0.98f, all_.faces * 0.98f, 0};
  add_face(all_, area, perimeter);
}

void Surroundings::insert(const Hypothesis& h, const Triangulation& triangulation) {
  const Patch& patch = h.patch;
  all_ = {all_.area * 0.9f, all_.perimeter * 0.9f, all_.faces * 0.9f, 0};
  VertexSums centre;
  for (unsigned k = 0; k < triangulation.triangles; ++k) {
    for (std::uint8_t corner : triangulation.corner[k]) --vertex_[patch.ring[corner]].open;
  }
  for (unsigned i = 0; i < patch.size; ++i) {
    if (i == patch.closing) continue;
    const float perimeter = 2.0f * h.spoke + length_[patch.inside[i]];
    add_face(vertex_[patch.ring[i]], h.face_area, perimeter);
    add_face(vertex_[patch.ring[i + 1 < patch.size ? i + 1 : 0]], h.face_area, perimeter);
    add_face(all_, h.face_area, perimeter);
    add_face(centre, h.face_area, perimeter);
  }
  vertex_.push_back(centre);
}

}  // namespace pmcd::codec
