// SPDX-License-Identifier: MIT
// The walk over a mesh, gate by gate, that both conquests share and that encoder and decoder share: which gate is next,
// what becomes conquered, which tags are given. What stands before a gate (and rewriting it) is the driver's business:
// the encoder's removes vertices, the decoder's inserts them, and both then see the same ring.
// Source: Alliez and Desbrun 2001, sections 3 (decimating conquest) and 4 (cleaning conquest).
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "codec/conquest/patch.h"
#include "codec/conquest/triangulation.h"
#include "codec/mesh/halfedge_mesh.h"

namespace pmcd::codec {

/// Two bits in the stream. Ear passes (ears.h) are no conquest.
enum class PassKind : std::uint8_t { decimating = 0, cleaning = 1, ears = 2 };

/// What was decided at a gate: 0 = null patch, 3 to 6 = valence of the removed interior vertex, from kBorder on a
/// border patch (border_symbol).
using Symbol = std::uint8_t;
inline constexpr Symbol kNull = 0;
inline constexpr Symbol kBorder = 8;
inline constexpr unsigned kBorderSymbols = 5;

/// A border patch has 3 or 4 ring vertices, and the ring edge that closes it is not the gate. The paper lets only the
/// two ends of the ring lie on the boundary and then knows which edge that is; naming it lets strips and ragged
/// boundaries shrink too, and costs next to nothing where it can be guessed.
constexpr Symbol border_symbol(unsigned size, unsigned closing) {
  return static_cast<Symbol>(kBorder + (size == 3 ? 0 : 2) + closing);
}
inline constexpr Symbol kImpossible = 0xFF;  ///< a driver's answer when it cannot go on

/// The two vertices from which the walk over a component starts; they are never removed.
struct Seed {
  std::uint32_t s;
  std::uint32_t t;
};

/// What a gate's parent was and which of its gates this is: the n-th edge of a null patch's face or of a patch's ring.
constexpr std::uint8_t parent_code(Symbol symbol, unsigned index) {
  if (symbol == kNull) return static_cast<std::uint8_t>(index);
  if (symbol >= kBorder) return static_cast<std::uint8_t>(2 + 5 * 4 + index);
  return static_cast<std::uint8_t>(2 + 5 * (symbol - 3) + index);
}
inline constexpr std::uint8_t kSeedParent = 2 + 5 * 5;
inline constexpr std::uint8_t kSteppedParent = kSeedParent + 1;  ///< over a face, in a cleaning conquest
inline constexpr std::size_t kParents = kSteppedParent + 1;

/// A half-edge before which something is to be decided.
struct Gate {
  std::uint32_t halfedge;
  std::uint8_t parent;  ///< where it came from (parent_code)
};

/// What a pass remembers of the mesh; cleared at its start, kept from pass to pass for its memory.
struct Marks {
  std::vector<std::uint8_t> face;       ///< not 0: conquered
  std::vector<std::uint8_t> conquered;  ///< by vertex
  std::vector<Tag> tag;                 ///< by vertex
  std::vector<Gate> queue;              ///< first in first out
  std::vector<std::uint32_t> order;     ///< faces as they were conquered
  std::uint8_t gate_parent = 0;         ///< of the gate that is being decided

  void clear(const HalfEdgeMesh& mesh) {
    face.assign(mesh.face_count(), 0);
    conquered.assign(mesh.vertex_count(), 0);
    tag.assign(mesh.vertex_count(), Tag::none);
    queue.clear();
    order.clear();
    order.reserve(mesh.face_count());
  }

  void conquer_face(std::uint32_t f) {
    face[f] = 1;
    order.push_back(f);
  }
};

/// So many gates that the walk has passed are still kept.
inline constexpr std::ptrdiff_t kMostPassedGates = 1 << 16;

/// One pass over all components. Driver: `Symbol decide(gate, Tag s, Tag t, Patch&)` answers what stands before the
/// gate and, unless it is a null patch, has rewritten it and filled the patch; kImpossible ends the walk.
/// `void step_over(gate)`: the face before the gate is conquered as it is, without a symbol (cleaning only). Answers
/// false only after kImpossible. [linear in the faces]
template <typename Driver>
bool conquer(const HalfEdgeMesh& mesh, std::span<const Seed> seeds, PassKind kind, Marks& marks, Driver& driver) {
  marks.clear(mesh);
  auto push = [&](std::uint32_t gate, std::uint8_t parent) {
    if (gate != kNone && marks.face[HalfEdgeMesh::face_of(gate)] == 0) marks.queue.push_back({gate, parent});
  };
  Patch patch;
  for (const Seed& seed : seeds) {
    marks.queue.clear();
    marks.conquered[seed.s] = marks.conquered[seed.t] = 1;
    marks.tag[seed.t] = Tag::plus;
    marks.tag[seed.s] = Tag::minus;
    const std::uint32_t first = mesh.find_halfedge(seed.s, seed.t);
    if (first == kNone) return false;
    push(first, kSeedParent);
    push(mesh.opposite(first), kSeedParent);  // the first face may be a dead end in the corner of a boundary
    for (std::size_t head = 0; head < marks.queue.size(); ++head) {
      if (head == kMostPassedGates) {
        marks.queue.erase(marks.queue.begin(), marks.queue.begin() + kMostPassedGates);
        head = 0;
      }
      const auto [gate, parent] = marks.queue[head];
      // A face that was rewritten since lies in a conquered slot too.
      if (marks.face[HalfEdgeMesh::face_of(gate)] != 0) continue;
      const Tag tag_s = marks.tag[mesh.origin(gate)];
      const Tag tag_t = marks.tag[mesh.target(gate)];
      marks.gate_parent = parent;
      const Symbol symbol = driver.decide(gate, tag_s, tag_t, patch);
      if (symbol == kImpossible) return false;
      if (symbol == kNull) {
        const std::uint32_t front = mesh.apex(gate);
        marks.conquer_face(HalfEdgeMesh::face_of(gate));
        marks.conquered[front] = 1;
        if (marks.tag[front] == Tag::none) {
          marks.tag[front] = tag_s == Tag::plus && tag_t == Tag::plus ? Tag::minus : Tag::plus;
        }
        push(mesh.opposite(HalfEdgeMesh::next(gate)), parent_code(kNull, 0));
        push(mesh.opposite(HalfEdgeMesh::prev(gate)), parent_code(kNull, 1));
        continue;
      }
      while (marks.face.size() < mesh.face_count()) marks.face.push_back(1);
      while (marks.tag.size() < mesh.vertex_count()) {
        marks.conquered.push_back(1);
        marks.tag.push_back(Tag::plus);
      }
      for (unsigned i = 0; i < patch.slot_count; ++i) marks.conquer_face(patch.slots[i]);
      for (std::uint32_t v : patch.ring_vertices()) marks.conquered[v] = 1;
      if (kind == PassKind::decimating) {
        const Triangulation& triangulation = patch.is_border() ? border_triangulation(patch.size, patch.closing, tag_t)
                                                               : interior_triangulation(patch.size, tag_s, tag_t);
        for (unsigned i = 0; i < patch.size; ++i) {
          Tag& tag = marks.tag[patch.ring[i]];
          if (tag == Tag::none) tag = triangulation.tag[i];
        }
        for (unsigned i = 0; i + 1 < patch.size; ++i) push(patch.outside[i], parent_code(symbol, i));
        continue;
      }
      // Cleaning: the faces beyond the two other ring edges are stepped over without a symbol. Their third vertices
      // are conquered too: two vertices of valence 3 may face each other there.
      for (unsigned i = 0; i + 1 < patch.size; ++i) {
        const std::uint32_t beyond = patch.outside[i];
        if (beyond == kNone || marks.face[HalfEdgeMesh::face_of(beyond)] != 0) continue;
        driver.step_over(beyond);
        marks.conquer_face(HalfEdgeMesh::face_of(beyond));
        marks.conquered[mesh.apex(beyond)] = 1;
        push(mesh.opposite(HalfEdgeMesh::next(beyond)), kSteppedParent);
        push(mesh.opposite(HalfEdgeMesh::prev(beyond)), kSteppedParent);
      }
    }
  }
  return true;
}

}  // namespace pmcd::codec
