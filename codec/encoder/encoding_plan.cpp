// SPDX-License-Identifier: MIT
#include "codec/encoder/encoding_plan.h"

#include <algorithm>
#include <span>
#include <utility>

#include "codec/encoder/exactness_search.h"
#include "codec/encoder/reflection_search.h"

namespace pmcd::codec {
namespace {

// The lattice under a lossless mesh. Its total hardly depends on it (12 to 20 bits: within 0.2 % on nine scans), so it
// is as coarse as keeps the levels true to the eye; what is below is left to exactness.
constexpr unsigned kLosslessBits = 14;

// Isolated vertices along a Morton curve, so that steps from one to the next are short.
std::vector<std::uint32_t> sort_isolated(const HalfEdgeMesh& mesh, std::span<const LatticePoint> points) {
  std::vector<std::uint32_t> isolated;
  for (std::uint32_t v = 0; v < mesh.vertex_count(); ++v) {
    if (mesh.outgoing(v) == kNone) isolated.push_back(v);
  }
  auto before = [&](std::uint32_t a, std::uint32_t b) {
    // The axis whose highest differing bit is highest decides; no interleaving needed.
    std::size_t deciding = 0;
    std::uint32_t most = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto difference = static_cast<std::uint32_t>(points[a][axis] ^ points[b][axis]);
      if (most < difference && most < (most ^ difference)) {
        most = difference;
        deciding = axis;
      }
    }
    return points[a][deciding] != points[b][deciding] ? points[a][deciding] < points[b][deciding] : a < b;
  };
  std::sort(isolated.begin(), isolated.end(), before);
  return isolated;
}

// What decimation left, without its free slots and the vertices that went: small, so that it can be kept.
Descent from_base(const HalfEdgeMesh& mesh, std::span<const Seed> seeds) {
  Descent descent;
  HalfEdgeMesh& base = descent.base;
  std::vector<std::uint32_t> vertex(mesh.vertex_count(), kNone);
  for (std::uint32_t v = 0; v < mesh.vertex_count(); ++v) {
    if (mesh.outgoing(v) == kNone) continue;
    vertex[v] = base.add_vertex();
    descent.base_vertices.push_back(v);
  }
  std::vector<std::uint32_t> face(mesh.face_count(), kNone);
  for (std::uint32_t f = 0; f < mesh.face_count(); ++f) {
    if (!mesh.is_free_slot(f)) face[f] = base.add_face();
  }
  auto moved = [&](std::uint32_t h) {
    return h == kNone ? kNone : HalfEdgeMesh::halfedge(face[HalfEdgeMesh::face_of(h)], HalfEdgeMesh::edge_of(h));
  };
  for (std::uint32_t f = 0; f < mesh.face_count(); ++f) {
    if (mesh.is_free_slot(f)) continue;
    const Face corners = mesh.face(f);
    base.set_face(face[f], vertex[corners[0]], vertex[corners[1]], vertex[corners[2]]);
    for (std::uint32_t i = 0; i < 3; ++i) {
      const std::uint32_t h = HalfEdgeMesh::halfedge(f, i);
      base.link(moved(h), moved(mesh.opposite(h)));
    }
  }
  for (std::uint32_t v : descent.base_vertices) {
    base.set_outgoing(vertex[v], moved(mesh.outgoing(v)));
    base.change_face_valence(vertex[v], static_cast<int>(mesh.face_valence(v)));
  }
  for (const Seed& seed : seeds) descent.seeds.push_back({vertex[seed.s], vertex[seed.t]});
  return descent;
}

}  // namespace

Result<EncodingPlan> make_plan(const TriangleMesh& mesh, std::optional<unsigned> bits, HalfEdgeMesh& built) {
  EncodingPlan plan;
  plan.original = &mesh;
  plan.lossless = !bits.has_value();
  Result<Lattice> lattice = Lattice::over(mesh, bits.value_or(kLosslessBits));
  if (!lattice) return lattice.error();
  plan.lattice = std::move(lattice).value();
  if (plan.lossless) {
    LosslessPlan lossless = plan_lossless(mesh, plan.lattice);
    plan.lattice = lossless.lattice;
    plan.form = lossless.form;
  }
  plan.points.reserve(mesh.positions.size());
  for (const Position& p : mesh.positions) plan.points.push_back(plan.lattice.snap(p));
  plan.reflection = find_reflection(plan.points, plan.lattice.max_index(), plan.lattice.snap(Position{}));

  Result<HalfEdgeMesh> halfedges = HalfEdgeMesh::build(mesh.faces, mesh.positions.size());
  if (!halfedges) return halfedges.error();
  built = std::move(halfedges).value();
  plan.isolated = sort_isolated(built, plan.points);
  for (std::uint32_t f = 0; f < built.face_count(); ++f) plan.boundary_edges += built.boundary_edges(f);
  plan.alignment = alignment_of(mesh, plan.points);
  plan.precision = PrecisionPlan(mesh, plan.points, plan.alignment);
  return plan;
}

std::optional<Descent> descend(HalfEdgeMesh mesh, const EncodingPlan& plan, const DecimationOptions& options,
                               const DecimationProgress& progress) {
  const std::vector<Seed> seeds = choose_seeds(mesh);
  bool stopped = false;
  std::vector<PassRecord> passes = decimate(mesh, plan.points, seeds, options, progress, stopped);
  if (stopped) return std::nullopt;
  std::reverse(passes.begin(), passes.end());
  Descent descent = from_base(mesh, seeds);
  descent.passes = std::move(passes);
  return descent;
}

Descent stay(const HalfEdgeMesh& mesh) {
  return from_base(mesh, choose_seeds(mesh));
}

}  // namespace pmcd::codec
