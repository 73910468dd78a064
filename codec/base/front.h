// SPDX-License-Identifier: MIT
// The part of the base mesh that is known so far and its border: cyclic chains of half-edges beyond which nothing is
// known, or the boundary lies. Faces are attached beyond an open half-edge; the chains follow by changing links, be it
// that a chain parts in two (split) or two become one (handle). It decides nothing and knows no positions.
// Source of the idea: Gumhold and Strasser, Real time compression of triangle mesh connectivity (cut-border machine),
// SIGGRAPH 1998.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "codec/mesh/halfedge_mesh.h"
#include "codec/mesh/triangle_mesh.h"

namespace pmcd::codec {

class Front {
 public:
  // Half-edge 3 f + c runs from corner c of face f to the next corner, as in HalfEdgeMesh.
  [[nodiscard]] std::uint32_t origin(std::uint32_t h) const { return faces_[h / 3][h % 3]; }
  [[nodiscard]] std::uint32_t target(std::uint32_t h) const { return faces_[h / 3][(h + 1) % 3]; }
  [[nodiscard]] std::uint32_t apex(std::uint32_t h) const { return faces_[h / 3][(h + 2) % 3]; }
  [[nodiscard]] const std::vector<Face>& faces() const { return faces_; }
  [[nodiscard]] std::uint32_t face_count() const { return static_cast<std::uint32_t>(faces_.size()); }
  [[nodiscard]] std::uint32_t vertex_count() const { return static_cast<std::uint32_t>(first_open_.size()); }

  /// Nothing is known yet of what lies beyond.
  [[nodiscard]] bool is_open(std::uint32_t h) const { return place_[h] != kNone; }
  /// Known to be boundary: still a part of its chain.
  [[nodiscard]] bool is_boundary(std::uint32_t h) const { return boundary_[h] != 0; }
  /// In a chain. REQUIRES of after() and before(): on_border(h).
  [[nodiscard]] bool on_border(std::uint32_t h) const { return is_open(h) || is_boundary(h); }
  [[nodiscard]] std::uint32_t after(std::uint32_t h) const { return after_[h]; }
  [[nodiscard]] std::uint32_t before(std::uint32_t h) const { return before_[h]; }
  /// All open half-edges, in no order that means anything, but the same for encoder and decoder.
  [[nodiscard]] std::span<const std::uint32_t> open() const { return open_; }

  /// Whether a half-edge runs from a to b, as far as the 64 newest that leave a tell.
  [[nodiscard]] bool runs(std::uint32_t a, std::uint32_t b) const;
  /// Faces at v.
  [[nodiscard]] std::uint32_t face_valence(std::uint32_t v) const { return valence_[v]; }

  std::uint32_t add_vertex();
  /// The first face of a component, all three half-edges open. Answers the face.
  std::uint32_t add_first_face(std::uint32_t a, std::uint32_t b, std::uint32_t c);
  /// The face (target, origin, v) beyond the open half-edge `gate`. `entry`: the border half-edge that leaves v and
  /// comes after the new one that arrives there; kNone for a new vertex. Half-edges that meet their counterpart close.
  /// REQUIRES: v is neither end of the gate; origin(entry) == v. [constant, but see steps()]
  std::uint32_t attach(std::uint32_t gate, std::uint32_t entry, std::uint32_t v);
  /// What lies beyond the open half-edge is the boundary.
  void end_at_boundary(std::uint32_t gate);

  /// Steps taken in search of counterparts; only a forger piles up open edges at one vertex to make this search long.
  [[nodiscard]] bool tangled() const { return steps_ > 1000 + 64 * std::uint64_t{faces_.size()}; }

 private:
  void open_up(std::uint32_t h);
  void close(std::uint32_t h);
  void close_if_met(std::uint32_t h);
  void link(std::uint32_t h, std::uint32_t next) {
    after_[h] = next;
    before_[next] = h;
  }

  std::vector<Face> faces_;
  // By half-edge.
  std::vector<std::uint32_t> after_;
  std::vector<std::uint32_t> before_;
  std::vector<std::uint32_t> place_;      // in open_; kNone: not open
  std::vector<std::uint32_t> next_open_;  // of the same origin
  std::vector<std::uint32_t> next_out_;   // of the same origin
  std::vector<std::uint8_t> boundary_;
  // By vertex: head of the list of all half-edges that leave it, its length, and head of the list of open half-edges
  // that leave it; closed ones are dropped when met.
  std::vector<std::uint32_t> first_out_;
  std::vector<std::uint32_t> valence_;
  std::vector<std::uint32_t> first_open_;
  std::vector<std::uint32_t> open_;
  std::uint64_t steps_ = 0;
};

}  // namespace pmcd::codec
