// SPDX-License-Identifier: MIT
#include "codec/encoder/decimation.h"

#include <algorithm>
#include <array>
#include <utility>

#include "codec/conquest/ears.h"

namespace pmcd::codec {
namespace {

// A base mesh of so many vertices is small: from about 60 on one sees what it is, in 400 bytes; below, levels only bend
// away from the shape. A small mesh goes down further, so that it has levels too; many components keep a few each.
constexpr std::uint32_t kSmallBase = 80;
constexpr std::uint32_t kSmallestBase = 24;
constexpr std::uint32_t kShareOfSmallBase = 12;
constexpr std::uint32_t kSmallComponent = 6;
// Coarse levels hold few of the bytes and are what is seen first: there only flat places are thinned out. From this
// share of the mesh down, and to this bound on the change of shape, unless another is asked for.
constexpr std::uint32_t kCoarseShare = 8;
constexpr double kCoarseShapeError = 0.45;
// A pass that removes less than this share of the vertices has stalled.
constexpr double kStall = 0.08;
// Far more than a shrinking mesh needs (0.92^400 is 10^-15), fewer than a packet may hold.
constexpr std::size_t kMaxPassesDown = 400;

// The conquest's driver on the encoder's side: asks what may go, takes it out, writes it down.
class RemovingDriver {
 public:
  RemovingDriver(HalfEdgeMesh& mesh, std::span<const LatticePoint> points, const Marks& marks,
                 const GeometricLimits& limits, PassRecord& record)
      : mesh_(mesh), points_(points), marks_(marks), limits_(limits), record_(record) {}

  Symbol decide(std::uint32_t gate, Tag tag_s, Tag tag_t, Patch& patch) {
    const Symbol symbol = choose(gate, tag_s, tag_t, patch);
    record_.symbols.push_back(symbol);
    return symbol;
  }

  void step_over(std::uint32_t /*gate*/) {}

 private:
  Symbol choose(std::uint32_t gate, Tag tag_s, Tag tag_t, Patch& patch) {
    if (marks_.conquered[mesh_.apex(gate)] != 0 || !collect_star(mesh_, gate, patch)) return kNull;
    const bool cleaning = record_.kind == PassKind::cleaning;
    if (cleaning && (patch.size != 3 || patch.is_border())) return kNull;
    const Triangulation& triangulation = cleaning            ? interior_triangulation(3, Tag::plus, Tag::minus)
                                         : patch.is_border() ? border_triangulation(patch.size, patch.closing, tag_t)
                                                             : interior_triangulation(patch.size, tag_s, tag_t);
    if (!keeps_shape(points_, patch, triangulation, limits_) || !keeps_manifold(mesh_, patch, triangulation)) {
      return kNull;
    }
    remove_centre(mesh_, patch, triangulation);
    record_.removed.push_back(patch.centre);
    return patch.is_border() ? border_symbol(patch.size, patch.closing) : static_cast<Symbol>(patch.size);
  }

  HalfEdgeMesh& mesh_;
  std::span<const LatticePoint> points_;
  const Marks& marks_;
  const GeometricLimits& limits_;
  PassRecord& record_;
};

// Numbers the faces in the order of the walk that met them, all there are, without those that went: the next walk meets
// memory in order.
void compact(HalfEdgeMesh& mesh, Marks& marks) {
  std::erase_if(marks.order, [&](std::uint32_t face) { return mesh.is_free_slot(face); });
  mesh.reorder(marks.order);
}

// Clips every ear that stands alone: not a seed, not on the seed half-edge, not beside another of this pass that went.
PassRecord clip_ears(HalfEdgeMesh& mesh, std::span<const Seed> seeds, Marks& marks) {
  PassRecord record;
  record.kind = PassKind::ears;
  marks.clear(mesh);
  for (const Seed& seed : seeds) {
    marks.conquered[seed.s] = marks.conquered[seed.t] = 1;
    // The face of the seed half-edge stays, whatever its third vertex is.
    const std::uint32_t h = mesh.find_halfedge(seed.s, seed.t);
    if (h != kNone) marks.conquered[mesh.apex(h)] = 1;
  }
  std::vector<std::array<std::uint32_t, 2>> ears;  // edge origin, ear
  for (std::uint32_t x = 0; x < mesh.vertex_count(); ++x) {
    if (mesh.face_valence(x) != 1 || marks.conquered[x] != 0) continue;
    const std::uint32_t from_x = mesh.outgoing(x);
    const std::uint32_t b = mesh.target(from_x);
    const std::uint32_t a = mesh.apex(from_x);
    if (mesh.face_valence(a) < 2 || mesh.face_valence(b) < 2) continue;
    marks.conquered[a] = marks.conquered[b] = 1;
    remove_ear(mesh, x);
    ears.push_back({a, x});
  }
  std::sort(ears.begin(), ears.end());
  for (const auto& [base, ear] : ears) {
    record.ear_base.push_back(base);
    record.removed.push_back(ear);
  }
  return record;
}

}  // namespace

std::vector<Seed> choose_seeds(const HalfEdgeMesh& mesh) {
  std::vector<Seed> seeds;
  std::vector<std::uint8_t> seen(mesh.face_count(), 0);
  std::vector<std::uint32_t> stack;
  for (std::uint32_t start = 0; start < mesh.face_count(); ++start) {
    if (seen[start] != 0) continue;
    const std::uint32_t first = HalfEdgeMesh::halfedge(start, 0);
    seeds.push_back({mesh.origin(first), mesh.target(first)});
    seen[start] = 1;
    stack.assign(1, start);
    while (!stack.empty()) {
      const std::uint32_t face = stack.back();
      stack.pop_back();
      for (std::uint32_t i = 0; i < 3; ++i) {
        const std::uint32_t across = mesh.opposite(HalfEdgeMesh::halfedge(face, i));
        if (across == kNone || seen[HalfEdgeMesh::face_of(across)] != 0) continue;
        seen[HalfEdgeMesh::face_of(across)] = 1;
        stack.push_back(HalfEdgeMesh::face_of(across));
      }
    }
  }
  return seeds;
}

std::vector<PassRecord> decimate(HalfEdgeMesh& mesh, std::span<const LatticePoint> points, std::span<const Seed> seeds,
                                 const DecimationOptions& options, const DecimationProgress& progress,
                                 bool& cancelled) {
  cancelled = false;
  if (seeds.empty()) return {};
  std::vector<PassRecord> passes;
  std::uint32_t left = 0;
  bool has_boundary = false;
  for (std::uint32_t v = 0; v < mesh.vertex_count(); ++v) {
    if (mesh.outgoing(v) == kNone) continue;
    ++left;
    has_boundary = has_boundary || mesh.is_boundary(v);
  }
  const std::uint64_t of_components = kSmallestBase + std::uint64_t{kSmallComponent} * (seeds.size() - 1);
  const std::uint64_t small = std::max<std::uint64_t>(of_components, std::min(left / kShareOfSmallBase, kSmallBase));
  GeometricLimits limits = options.limits;
  bool limited = true;
  Marks marks;
  PassKind kind = PassKind::decimating;
  std::uint32_t removed_by_pair = 0;
  const std::uint32_t coarse = left / kCoarseShare;
  for (;;) {
    if (limited && left <= coarse && !limits.max_shape_error) limits.max_shape_error = kCoarseShapeError;
    PassRecord record;
    record.kind = kind;
    RemovingDriver driver(mesh, points, marks, limits, record);
    conquer(mesh, seeds, kind, marks, driver);
    auto keep = [&](PassRecord&& done) {
      const auto removed = static_cast<std::uint32_t>(done.removed.size());
      removed_by_pair += removed;
      left -= removed;
      if (removed > 0) passes.push_back(std::move(done));
    };
    keep(std::move(record));
    compact(mesh, marks);
    if (has_boundary && kind == PassKind::decimating) keep(clip_ears(mesh, seeds, marks));
    if (progress && !progress(left)) {
      cancelled = true;
      return {};
    }
    if (options.cleaning && kind == PassKind::decimating) {
      kind = PassKind::cleaning;
      continue;
    }
    kind = PassKind::decimating;
    if (left <= small) break;
    // The last few vertices may go one by one for a while; a decoder accepts only so many passes.
    if (passes.size() >= kMaxPassesDown) break;
    const bool stalled = removed_by_pair < kStall * (left + removed_by_pair);
    if (stalled && limited) {
      limits = {};
      limited = false;
    } else if (removed_by_pair == 0) {
      break;
    }
    removed_by_pair = 0;
  }
  return passes;
}

}  // namespace pmcd::codec
