// SPDX-License-Identifier: MIT
// The connectivity symbol at a gate as a few binary decisions: null? else which patch, impossible ones left out at no
// cost. Contexts: the gate's tags, the front vertex, the faces beside, and how each patch would change the valences.
// Written once for both directions; the geometry is not asked.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>

#include "codec/conquest/conquest.h"
#include "codec/conquest/patch.h"
#include "codec/entropy/adaptive_bit.h"
#include "codec/mesh/halfedge_mesh.h"

namespace pmcd::codec {

class SymbolModel {
 public:
  /// Codes `wanted` (writing) or reads the symbol, and collects its polygon into `patch`; kImpossible when `wanted`
  /// cannot stand here, which no encoder asks for.
  template <typename Source>
  Symbol code_decimating(Source& source, const HalfEdgeMesh& mesh, const Marks& marks, std::uint32_t gate, Tag tag_s,
                         Tag tag_t, Symbol wanted, Patch& patch) {
    Candidates candidates;
    find_candidates(mesh, marks, gate, tag_s, tag_t, candidates);
    int best = 99;
    for (unsigned i = 0; i < candidates.count; ++i) best = std::min(best, candidates.gain[i]);
    const std::size_t tags = tag_context(tag_s, tag_t);

    const std::uint32_t front = mesh.apex(gate);
    const std::size_t front_state =
        marks.conquered[front] == 0 ? 0
                                    : (marks.tag[front] == Tag::plus ? 1u : (marks.tag[front] == Tag::minus ? 2u : 3u));
    const std::size_t beside = beside_context(mesh, marks, gate);
    const std::size_t gain = gain_context(best);
    if (source.bit(null_[tags][front_state][beside][gain], wanted == kNull)) return kNull;

    for (unsigned i = 0; i < candidates.count; ++i) {
      const Symbol symbol = candidates.symbol[i];
      const bool only_one_left = i + 1 == candidates.count;
      // Where a border patch closes is told by the ends of the gate that lie on the boundary, nearly always.
      const bool border = symbol >= kBorder;
      const std::size_t kind = border ? symbol - kBorder + 4u : symbol - 3u;
      const std::size_t state = border ? ends_context(mesh, gate) : front_state;
      if (only_one_left || source.bit(take_[tags][kind][gain_context(candidates.gain[i])][state], wanted == symbol)) {
        patch = candidates.patch[i];
        return symbol;
      }
    }
    return kImpossible;
  }

  /// The cleaning conquest's alphabet: 3 or null.
  template <typename Source>
  Symbol code_cleaning(Source& source, const HalfEdgeMesh& mesh, const Marks& marks, std::uint32_t gate, Symbol wanted,
                       Patch& patch) {
    Candidates candidates;
    add_candidate(mesh, marks, gate, interior_triangulation(3, Tag::plus, Tag::minus), kNoClosing, 3, candidates);
    const std::size_t front_state = marks.conquered[mesh.apex(gate)];
    const std::size_t beside = beside_context(mesh, marks, gate);
    if (source.bit(clean_[front_state][beside][gain_context(candidates.gain[0])], wanted == kNull)) return kNull;
    patch = candidates.patch[0];
    return 3;
  }

 private:
  static constexpr std::size_t kGains = 9;

  struct Candidates {
    static constexpr std::size_t kMost = 4 + kBorderSymbols;
    unsigned count = 0;
    std::array<Symbol, kMost> symbol{};
    std::array<Patch, kMost> patch;
    std::array<int, kMost> gain{};  // change of the sum of |valence - 6| over the ring if this patch is opened
  };

  static std::size_t tag_context(Tag s, Tag t) { return (s == Tag::plus ? 2u : 0u) + (t == Tag::plus ? 1u : 0u); }

  static std::size_t ends_context(const HalfEdgeMesh& mesh, std::uint32_t gate) {
    return (mesh.is_boundary(mesh.origin(gate)) ? 2u : 0u) + (mesh.is_boundary(mesh.target(gate)) ? 1u : 0u);
  }

  static std::size_t gain_context(int gain) { return static_cast<std::size_t>(std::clamp(gain, -4, 4) + 4); }

  // Whether the faces across the two other edges are conquered (or missing).
  static std::size_t beside_context(const HalfEdgeMesh& mesh, const Marks& marks, std::uint32_t gate) {
    auto taken = [&](std::uint32_t h) {
      const std::uint32_t across = mesh.opposite(h);
      return across == kNone || marks.face[HalfEdgeMesh::face_of(across)] != 0;
    };
    return (taken(HalfEdgeMesh::next(gate)) ? 2u : 0u) + (taken(HalfEdgeMesh::prev(gate)) ? 1u : 0u);
  }

  static void add_candidate(const HalfEdgeMesh& mesh, const Marks& marks, std::uint32_t gate,
                            const Triangulation& triangulation, unsigned closing, Symbol symbol,
                            Candidates& candidates) {
    Patch& patch = candidates.patch[candidates.count];
    if (!collect_polygon(mesh, gate, triangulation, closing, marks.face, patch)) return;
    int gain = 0;
    std::array<int, kMaxPatchSize> change{};
    for (unsigned i = 0; i < patch.size; ++i) change[i] = 2;
    for (unsigned k = 0; k < triangulation.triangles; ++k) {
      for (std::uint8_t corner : triangulation.corner[k]) --change[corner];
    }
    for (unsigned i = 0; i < patch.size; ++i) {
      const auto now = static_cast<int>(std::min<std::uint32_t>(mesh.face_valence(patch.ring[i]), 100));
      const int ideal = mesh.is_boundary(patch.ring[i]) ? 3 : 6;
      gain += std::abs(now + change[i] - ideal) - std::abs(now - ideal);
    }
    candidates.symbol[candidates.count] = symbol;
    candidates.gain[candidates.count] = gain;
    ++candidates.count;
  }

  static void find_candidates(const HalfEdgeMesh& mesh, const Marks& marks, std::uint32_t gate, Tag tag_s, Tag tag_t,
                              Candidates& candidates) {
    // A border patch takes in a boundary edge of at most two faces: then a vertex of the gate's face lies there.
    if (ends_context(mesh, gate) != 0 || mesh.is_boundary(mesh.apex(gate))) {
      for (unsigned size = 4; size >= 3; --size) {
        for (unsigned closing = 0; closing + 1 < size; ++closing) {
          add_candidate(mesh, marks, gate, border_triangulation(size, closing, tag_t), closing,
                        border_symbol(size, closing), candidates);
        }
      }
    }
    for (unsigned size = 6; size >= 3; --size) {
      add_candidate(mesh, marks, gate, interior_triangulation(size, tag_s, tag_t), kNoClosing,
                    static_cast<Symbol>(size), candidates);
    }
  }

  std::array<std::array<std::array<std::array<AdaptiveBit, kGains>, 4>, 4>, 4> null_;
  std::array<std::array<std::array<std::array<AdaptiveBit, 4>, kGains>, 4 + kBorderSymbols>, 4> take_;
  std::array<std::array<std::array<AdaptiveBit, kGains>, 4>, 2> clean_;
};

}  // namespace pmcd::codec
