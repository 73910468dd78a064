// SPDX-License-Identifier: MIT
// The one retriangulation table: how the polygon that a removed vertex leaves is cut into triangles, and which tags its
// ring gets. A function of the polygon's size and of the two tags at the gate only, so that the decoder repeats it.
// Source: Alliez and Desbrun 2001, section 3 (figures 6 and 7); the entries as listed in the project's codec notes.
#pragma once

#include <array>
#include <cstdint>

namespace pmcd::codec {

inline constexpr unsigned kMaxPatchSize = 6;

/// What a vertex wishes for its valence while patches around it are cut: plus may grow, minus should shrink.
enum class Tag : std::uint8_t { none = 0, plus = 1, minus = 2 };

/// Ring vertices are numbered counter-clockwise from the gate s -> t: 0 = t, 1, ..., size - 1 = s. Ring edge i runs
/// from vertex i to vertex i + 1; the last one is the gate.
struct Triangulation {
  struct Step {
    std::uint8_t from_triangle = 0;  ///< a triangle placed before ...
    std::uint8_t from_edge = 0;      ///< ... and the edge of it across which this one lies
    std::uint8_t entry_edge = 0;     ///< the same edge as this triangle numbers it
  };
  std::uint8_t shape = 0;      ///< alike for all with the same triangles, below 8
  std::uint8_t size = 0;       ///< vertices of the polygon
  std::uint8_t triangles = 0;  ///< size - 2
  /// Corners as ring numbers; edge e of a triangle runs from corner e to corner e + 1.
  std::array<std::array<std::uint8_t, 3>, 4> corner{};
  /// Ring edge that edge e of a triangle is, or kDiagonal.
  std::array<std::array<std::uint8_t, 3>, 4> ring_edge{};
  /// How triangle k is reached; for triangle 0 only entry_edge counts: it is the gate.
  std::array<Step, 4> step{};
  std::array<std::uint8_t, kMaxPatchSize> faces_at{};  ///< triangles at each ring vertex
  std::array<std::array<std::uint8_t, 2>, 6> apart{};  ///< ring numbers of two vertices that share no triangle
  std::uint8_t apart_count = 0;
  std::array<std::array<std::uint8_t, 2>, 3> diagonal{};  ///< ring numbers of the triangles - 1 diagonals
  std::array<Tag, kMaxPatchSize> tag{};                   ///< for ring vertices 1 .. size - 2 that have none yet

  static constexpr std::uint8_t kDiagonal = 0xFF;
};

/// REQUIRES: 3 <= size <= 6, neither tag is none.
const Triangulation& interior_triangulation(unsigned size, Tag tag_s, Tag tag_t);

/// A border patch: the fan of a boundary vertex with 2 or 3 faces, closed by the new boundary edge. `closing` is the
/// ring edge that becomes boundary. REQUIRES: 3 <= size <= 4, closing + 1 < size.
const Triangulation& border_triangulation(unsigned size, unsigned closing, Tag tag_t);

inline constexpr unsigned kNoClosing = 0xFF;  ///< of an interior patch

}  // namespace pmcd::codec
