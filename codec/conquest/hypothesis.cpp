// SPDX-License-Identifier: MIT
// Everything here steers decoding: single precision, + - * / and sqrt only, every quotient and logarithm guarded.
#include "codec/conquest/hypothesis.h"

#include <algorithm>
#include <cmath>

namespace pmcd::codec {
namespace {

// Lengths and areas below this are none, lattice units.
constexpr float kLeast = 0.05f;
// An offset is not nearer to nothing than this share of an edge, squared.
constexpr float kLeastOffset = 0.003f;
// Valences above are as good as this.
constexpr std::uint32_t kMaxValence = 10000;
constexpr float kFarthest = 4.0f;

Four at(const LatticePoint& p) {
  return Four{static_cast<float>(p[0]), static_cast<float>(p[1]), static_cast<float>(p[2]), 0};
}

// |a|^2, |b|^2, |c|^2, |d|^2; the fourth lanes mean nothing.
Four squared(Four a, Four b, Four c, Four d) {
  const Four ab_low = __builtin_shufflevector(a, b, 0, 4, 1, 5);
  const Four cd_low = __builtin_shufflevector(c, d, 0, 4, 1, 5);
  const Four ab_high = __builtin_shufflevector(a, b, 2, 6, 3, 7);
  const Four cd_high = __builtin_shufflevector(c, d, 2, 6, 3, 7);
  const Four x = __builtin_shufflevector(ab_low, cd_low, 0, 1, 4, 5);
  const Four y = __builtin_shufflevector(ab_low, cd_low, 2, 3, 6, 7);
  const Four z = __builtin_shufflevector(ab_high, cd_high, 0, 1, 4, 5);
  return x * x + y * y + z * z;
}

float squared(Four a) {
  const Four square = a * a;
  return square[0] + square[1] + square[2];
}

Four cross(Four a, Four b) {
  return Four{a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0], 0};
}

Four guarded_log2(Four x) {
  const Four least = Four{} + kLeast;
  return fast_log2(larger(x, least));
}

float least_of(Four a) {
  return std::min(std::min(a[0], a[1]), std::min(a[2], a[3]));
}

float most_of(Four a) {
  return std::max(std::max(a[0], a[1]), std::max(a[2], a[3]));
}

// Factors by whether there is something to count.
constexpr std::array<Four, 2> kIfRefined = {Four{0, 0, 0, 0}, Four{1, 1, 1, 1}};

void set_bounded(SymbolInputs& inputs, const std::array<Four, kSymbolInputs / 4>& fours) {
  for (std::size_t i = 0; i < fours.size(); ++i) {
    store_four(&inputs.value[4 * i], smaller(larger(fours[i], Four{} - kFarthest), Four{} + kFarthest));
  }
}

// What a decision makes of a vertex.
struct Outcome {
  std::uint8_t state = 0;     // Hypothesis::state
  std::int8_t deviation = 0;  // growth of |valence - 6|
};
constexpr unsigned kMostOpen = 7;  // above, all is alike
constexpr unsigned kMostValence = 15;
constexpr std::uint16_t brief_of(unsigned open, unsigned valence) {
  return static_cast<std::uint16_t>(std::min(open, kMostOpen) * (kMostValence + 1) + std::min(valence, kMostValence));
}
constexpr std::size_t kBriefs = (kMostOpen + 1) * (kMostValence + 1);
// By faces at it that are decided, at most 4, and faces that it gets for them, at most 2.
constexpr auto kOutcome = [] {
  std::array<std::array<Outcome, kBriefs>, 5 * 3> outcomes{};
  auto size = [](int x) { return x < 0 ? -x : x; };
  for (int decided = 0; decided < 5; ++decided) {
    for (int gets = 0; gets < 3; ++gets) {
      for (int open = 0; open <= static_cast<int>(kMostOpen); ++open) {
        for (int valence = 0; valence <= static_cast<int>(kMostValence); ++valence) {
          const int change = gets - decided;
          const int after = std::clamp(valence + change, 2, 11);
          outcomes[3 * static_cast<std::size_t>(decided) + static_cast<std::size_t>(gets)]
                  [brief_of(static_cast<unsigned>(open), static_cast<unsigned>(valence))] = {
                      static_cast<std::uint8_t>(std::clamp(open - decided, 0, 3) * 10 + after - 2),
                      static_cast<std::int8_t>(size(after - 6) - size(after - change - 6))};
        }
      }
    }
  }
  return outcomes;
}();

}  // namespace

inline void Surroundings::change(Vertex& at, unsigned faces, int growth) {
  at.open = static_cast<std::uint16_t>(at.open > faces ? at.open - faces : 0);
  at.valence = static_cast<std::uint16_t>(std::clamp(at.valence + growth, 0, 2 * static_cast<int>(kMaxValence)));
  at.brief = brief_of(at.open, at.valence);
}

Surroundings::Surroundings(const HalfEdgeMesh& mesh, std::span<const LatticePoint> points, PassKind kind,
                           std::uint32_t previous, std::uint32_t most_vertices)
    : kind_(kind), previous_(previous) {
  if (kind == PassKind::ears) return;
  const std::uint32_t faces = mesh.face_count();
  face_.resize(faces);
  vertex_.reserve(std::min<std::size_t>(most_vertices, std::size_t{mesh.vertex_count()} + faces));  // one for each face
  vertex_.resize(mesh.vertex_count());
  for (std::uint32_t v = 0; v < mesh.vertex_count(); ++v) {
    vertex_[v].position = at(points[v]);
    const auto valence = static_cast<std::uint16_t>(std::min(mesh.face_valence(v), kMaxValence));
    vertex_[v].open = valence;
    vertex_[v].valence = valence;
    vertex_[v].brief = brief_of(valence, valence);
  }
  for (std::uint32_t f = 0; f < faces; ++f) {
    const Face corners = mesh.face(f);
    const Four a = vertex_[corners[0]].position;
    const Four b = vertex_[corners[1]].position;
    const Four c = vertex_[corners[2]].position;
    const Four normal = cross(b - a, c - a);
    const Four squares = squared(b - a, c - b, a - c, normal);
    const Four logs = 0.5f * guarded_log2(squares);
    face_[f] = {std::sqrt(squares[3]), logs[3], {logs[0], logs[1], logs[2]}};
    for (std::uint32_t i = 0; i < 3; ++i) {
      if (mesh.opposite(3 * f + i) != kNone) continue;
      has_boundary_ = true;
      change(vertex_[corners[i]], 0, 3);  // once a vertex: one boundary edge leaves it
    }
  }
}

// After its face at the gate stayed as it is.
inline std::uint8_t Surroundings::state_of(std::uint32_t v) const {
  return kOutcome[3 * 1 + 1][vertex_[v].brief].state;
}

Surroundings::Scale Surroundings::measure(std::uint32_t s, std::uint32_t t, std::uint32_t front) const {
  const Vertex& at_s = vertex_[s];
  const Vertex& at_t = vertex_[t];
  const Vertex& at_front = vertex_[front];
  // A little of the whole pass steadies the local means and stands in for them at a seed.
  constexpr float kPrior = 0.5f;
  const float prior = kPrior / std::max(all_.faces, 1.0f);
  const Four counts{static_cast<float>(at_s.faces), static_cast<float>(at_t.faces), static_cast<float>(at_front.faces),
                    0};
  const float faces = counts[0] + counts[1] + kPrior;
  const Four sums{at_s.log_area + at_t.log_area + at_front.log_area + prior * all_.log_area,
                  at_s.log_length + at_t.log_length + prior * all_.log_length, at_s.log_area, at_t.log_area};
  const Four means = sums / Four{faces + counts[2], faces, std::max(counts[0], 1.0f), std::max(counts[1], 1.0f)};
  return {means[0], means[1], fast_exp2(-2.0f * means[1]), means[2], means[3]};
}

void Surroundings::describe_null(const HalfEdgeMesh& mesh, const Marks& marks, std::uint32_t gate, const Scale& scale,
                                 Hypothesis& h) const {
  const std::uint32_t t = mesh.target(gate);
  const std::uint32_t s = mesh.origin(gate);
  const std::uint32_t front = mesh.apex(gate);
  h.symbol = kNull;
  h.row = 0;
  h.state = {state_of(t), state_of(front), state_of(s), kNoVertex, kNoVertex, kNoVertex};
  // Where a parallelogram over a refined neighbour expects the third corner, against where it is.
  const std::array<Four, 3> corner = {vertex_[s].position, vertex_[t].position, vertex_[front].position};
  const Four sum = corner[0] + corner[1] + corner[2];
  auto kite = [&](std::uint32_t across, Four actual) {
    return squared(actual + actual - sum + vertex_[mesh.apex(across)].position);
  };
  const std::uint32_t next = HalfEdgeMesh::next(gate);
  const std::uint32_t prev = HalfEdgeMesh::prev(gate);
  const std::uint32_t behind = mesh.opposite(gate);
  float kites = 0;
  float kite_count = 0;
  auto add_kite = [&](std::uint32_t inner, Four actual) {  // without a branch, as in describe_patch
    const std::uint32_t outside = mesh.opposite(inner);
    const std::uint32_t across = outside == kNone ? gate : outside;
    const float refined = marks.face[HalfEdgeMesh::face_of(across)] != 0 ? 1.0f : 0.0f;
    kites += refined * kite(across, actual);
    kite_count += refined;
  };
  add_kite(next, corner[0]);
  add_kite(prev, corner[1]);
  const float of_gate = behind == kNone ? 0.0f : kite(behind, corner[2]);
  const Four logs =
      0.5f *
      fast_log2(Four{of_gate, kite_count > 1 ? 0.5f * kites : kites, 0, 0} * scale.per_edge_squared + kLeastOffset);
  auto recent = [&](std::uint32_t v) { return static_cast<int>(v >= previous_); };
  auto few = [](std::uint32_t n) { return 0.2f * static_cast<float>(std::min<std::uint32_t>(n, 16)); };
  const FaceShape& face = face_[HalfEdgeMesh::face_of(gate)];
  const float log_next = face.log_length[next % 3];
  const float log_prev = face.log_length[prev % 3];
  const float log_gate = face.log_length[gate % 3];
  set_bounded(h.input, {Four{face.log_area - scale.log_area, log_next + log_prev - 2.0f * scale.log_edge,
                             few(mesh.face_valence(front)) - 1.2f, few(vertex_[front].open)},
                        Four{few(vertex_[s].open + vertex_[t].open), static_cast<float>(recent(front)),
                             std::max(log_next, log_prev) - log_gate, log_gate - scale.log_edge},
                        Four{few(mesh.face_valence(s)) + few(mesh.face_valence(t)) - 2.4f, log_next - log_prev, logs[0],
                             kite_count > 0 ? logs[1] : 0.0f},
                        Four{static_cast<float>(recent(s) + recent(t)), scale.log_area_s - scale.log_area,
                             scale.log_area_t - scale.log_area, few(vertex_[front].faces)}});
}

template <unsigned kSize, bool kIsBorder>
void Surroundings::describe_patch(const HalfEdgeMesh& mesh, const Marks& marks, const Triangulation& triangulation,
                                  const Scale& scale, Hypothesis& h) const {
  static constexpr std::array<float, kMaxPatchSize + 1> kShare = {0,        1,        1 / 2.0f, 1 / 3.0f,
                                                                  1 / 4.0f, 1 / 5.0f, 1 / 6.0f};
  const Patch& patch = h.patch;
  constexpr unsigned kTriangles = kSize - 2;
  constexpr float kShareOfRing = 1.0f / static_cast<float>(kSize);

  float area = 0;
  float least_face = face_[patch.slots[0]].log_area;
  float most_face = least_face;
  for (unsigned k = 0; k < kTriangles; ++k) {
    const FaceShape& face = face_[patch.slots[k]];
    area += face.area;
    least_face = std::min(least_face, face.log_area);
    most_face = std::max(most_face, face.log_area);
  }

  std::array<Four, kMaxPatchSize> ring;
  Four mean{};
  int recent = 0;
  int regular = 0;
  for (unsigned i = 0; i < kSize; ++i) {
    const std::uint32_t v = patch.ring[i];
    ring[i] = vertex_[v].position;
    mean += ring[i];
    recent += v >= previous_ ? 1 : 0;
    const unsigned gets = kIsBorder ? static_cast<unsigned>(star_faces(patch, i)) : 2u;
    const Outcome after = kOutcome[3u * triangulation.faces_at[i] + gets][vertex_[v].brief];
    h.state[i] = after.state;
    regular += after.deviation;
  }
  mean *= kShareOfRing;

  // In two groups of four, the second empty or with its last vertex repeated.
  constexpr bool kIsLarge = kSize > 4;
  std::array<Four, 8> spoke;
  std::array<Four, 8> kite{};
  float border = 0;
  float longest = log_length(patch.inside[0]);
  float shortest = longest;
  unsigned kite_count = 0;
  for (unsigned i = 0; i < kSize; ++i) {
    spoke[i] = ring[i] - mean;
    const float edge = log_length(patch.inside[i]);
    border += edge;
    longest = std::max(longest, edge);
    shortest = std::min(shortest, edge);
    // Where a parallelogram over a refined neighbour expects the new vertex, against the mean of the ring. Whether
    // there is one is hard to foresee, so there is no branch: at the boundary, the undecided face of slot 0 stands in.
    const std::uint32_t outside = patch.outside[i];
    const std::uint32_t across = outside == kNone ? 3 * patch.slots[0] : outside;
    const bool refined = marks.face[HalfEdgeMesh::face_of(across)] != 0;
    kite[i] = kIfRefined[refined] * (vertex_[mesh.apex(across)].position - ring[i + 1 < kSize ? i + 1 : 0] - spoke[i]);
    kite_count += refined ? 1u : 0u;
  }
  for (unsigned i = kSize; i < 8; ++i) spoke[i] = spoke[kSize - 1];
  const Four kites_low = squared(kite[0], kite[1], kite[2], kite[3]);
  const Four kites_high = kIsLarge ? squared(kite[4], kite[5], kite[6], kite[7]) : Four{};
  const float kites = sum_of(kites_low + kites_high);
  const float of_gate = kIsLarge ? kites_high[kSize % 4 == 1 ? 0 : 1] : kites_low[kSize == 3 ? 2 : 3];
  const Four spokes_low = squared(spoke[0], spoke[1], spoke[2], spoke[3]);
  const Four spokes_high = kIsLarge ? squared(spoke[4], spoke[5], spoke[6], spoke[7]) : spokes_low;
  const float spokes = (kSize == 3 ? spokes_low[0] + spokes_low[1] + spokes_low[2] : sum_of(spokes_low)) +
                       (kSize == 6 ? spokes_high[0] + spokes_high[1] : (kSize == 5 ? spokes_high[0] : 0.0f));
  const float least = least_of(smaller(spokes_low, spokes_high));
  const float most = most_of(larger(spokes_low, spokes_high));
  float diagonals = 0;
  float longest_diagonal = 0;
  float shortest_diagonal = 1e30f;
  for (unsigned k = 0; k + 1u < kTriangles; ++k) {
    const float diagonal = squared(ring[triangulation.diagonal[k][0]] - ring[triangulation.diagonal[k][1]]);
    diagonals += diagonal;
    longest_diagonal = std::max(longest_diagonal, diagonal);
    shortest_diagonal = std::min(shortest_diagonal, diagonal);
  }

  for (unsigned i = kSize; i < kMaxPatchSize; ++i) h.state[i] = kNoVertex;
  const float border_mean = border * kShareOfRing;
  const float face_area = area * (kIsBorder ? kShare[kSize - 1] : kShareOfRing);
  const Four unit = Four{} + scale.per_edge_squared;
  const Four diagonal_logs =
      0.5f * fast_log2(Four{diagonals * kShare[kTriangles - 1u], shortest_diagonal, longest_diagonal, 0} * unit +
                       kLeastOffset);
  const Four lengths = 0.5f * fast_log2(Four{most, least, of_gate, kites * kShare[kite_count]} * unit + kLeastOffset);
  const Four whole = guarded_log2(Four{face_area, spokes * kShareOfRing, 1.0f, 1.0f});
  h.log_area = whole[0];
  h.log_spoke = 0.5f * whole[1];
  set_bounded(h.input, {Four{h.log_area - scale.log_area, 0.3f * static_cast<float>(regular),
                             kSize > 3 ? diagonal_logs[1] : 0.0f, border_mean - scale.log_edge},
                        Four{longest - border_mean, static_cast<float>(recent) * kShareOfRing,
                             kSize > 3 ? diagonal_logs[0] : 0.0f, kSize > 3 ? diagonal_logs[2] : 0.0f},
                        Four{shortest - border_mean, lengths[0], lengths[1], of_gate > 0 ? lengths[2] : 0.0f},
                        Four{kite_count > 0 ? lengths[3] : 0.0f, static_cast<float>(kite_count) * kShareOfRing,
                             least_face - scale.log_area, most_face - scale.log_area}});
}

std::span<const Hypothesis> Surroundings::look(const HalfEdgeMesh& mesh, const Marks& marks, std::uint32_t gate,
                                               Tag tag_s, Tag tag_t) {
  const std::uint32_t s = mesh.origin(gate);
  const std::uint32_t t = mesh.target(gate);
  const std::uint32_t front = mesh.apex(gate);
  const Scale scale = measure(s, t, front);
  describe_null(mesh, marks, gate, scale, hypothesis_[0]);
  std::size_t count = 1;
  auto consider = [&]<unsigned kSize, bool kIsBorder>(const Triangulation& triangulation, unsigned closing,
                                                      std::size_t row) {
    Hypothesis& h = hypothesis_[count];
    if (!collect_polygon(mesh, gate, triangulation, closing, marks.face, h.patch)) return;
    h.symbol = kIsBorder ? border_symbol(kSize, closing) : static_cast<Symbol>(kSize);
    h.row = static_cast<std::uint8_t>(row);
    describe_patch<kSize, kIsBorder>(mesh, marks, triangulation, scale, h);
    ++count;
  };
  auto consider_interior = [&]<unsigned kSize>() {
    consider.template operator()<kSize, false>(interior_triangulation(kSize, tag_s, tag_t), kNoClosing, kSize - 2u);
  };
  auto consider_border = [&]<unsigned kSize>() {
    for (unsigned closing = 0; closing + 1 < kSize; ++closing) {
      consider.template operator()<kSize, true>(border_triangulation(kSize, closing, tag_t), closing,
                                                5u + border_symbol(kSize, closing) - kBorder);
    }
  };
  if (kind_ == PassKind::cleaning) {
    tag_s = Tag::plus;
    tag_t = Tag::minus;
    consider_interior.template operator()<3>();
    return {hypothesis_.data(), count};
  }
  // A border patch takes in a boundary edge of at most two faces: then a vertex of the gate's face lies there.
  if (has_boundary_ && (mesh.is_boundary(s) || mesh.is_boundary(t) || mesh.is_boundary(front))) {
    consider_border.template operator()<4>();
    consider_border.template operator()<3>();
  }
  consider_interior.template operator()<6>();
  consider_interior.template operator()<5>();
  consider_interior.template operator()<4>();
  consider_interior.template operator()<3>();
  return {hypothesis_.data(), count};
}

void Surroundings::fade(float by) {
  all_.log_area *= by;
  all_.log_length *= by;
  all_.faces *= by;
}

void Surroundings::keep(const HalfEdgeMesh& mesh, std::uint32_t gate) {
  const FaceShape& face = face_[HalfEdgeMesh::face_of(gate)];
  const float edge = (face.log_length[0] + face.log_length[1] + face.log_length[2]) * (1.0f / 3.0f);
  for (std::uint32_t v : mesh.face(HalfEdgeMesh::face_of(gate))) {
    add_face(vertex_[v], face.log_area, edge);
    change(vertex_[v], 1, 0);
  }
  fade(0.98f);
  add_face(all_, face.log_area, edge);
}

void Surroundings::insert(const Hypothesis& h, const Triangulation& triangulation, const LatticePoint& position) {
  const Patch& patch = h.patch;
  fade(0.9f);
  Vertex centre;
  centre.position = at(position);
  centre.valence = static_cast<std::uint16_t>(patch.is_border() ? patch.size + 2 : patch.size);
  centre.brief = brief_of(0, centre.valence);
  for (unsigned i = 0; i < patch.size; ++i) {
    Vertex& corner = vertex_[patch.ring[i]];
    change(corner, triangulation.faces_at[i], star_faces(patch, i) - triangulation.faces_at[i]);
    if (i == patch.closing) continue;
    const float edge = (2.0f * h.log_spoke + log_length(patch.inside[i])) * (1.0f / 3.0f);
    for (Vertex* v : {&corner, &vertex_[patch.ring[i + 1 < patch.size ? i + 1 : 0]], &centre}) {
      add_face(*v, h.log_area, edge);
    }
    add_face(all_, h.log_area, edge);
  }
  vertex_.push_back(centre);
}

}  // namespace pmcd::codec
