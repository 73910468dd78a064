// SPDX-License-Identifier: MIT
// What could stand before a gate, each possibility with what the geometry says of it: a removed vertex leaves faces
// that are too large and edges that are too long against the refined ones nearby, and valences that come out right.
// Source: geometry-guided prediction of connectivity goes back to Lewiner et al. (GEncode, 2004) and Kaelberer et al.
// (FreeLence, 2005); these features are ours. It neither decides nor codes (symbol_model.h does).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "codec/conquest/conquest.h"
#include "codec/conquest/patch.h"
#include "codec/entropy/softmax.h"
#include "codec/lattice/lattice.h"
#include "codec/mesh/halfedge_mesh.h"

namespace pmcd::codec {

inline constexpr std::size_t kSymbolInputs = 16;
using SymbolInputs = Lanes<kSymbolInputs>;

/// Rows of the models' tables: null, 3 to 6, border patches.
inline constexpr std::size_t kSymbolRows = 5 + kBorderSymbols;

struct Hypothesis {
  Symbol symbol = kNull;
  std::uint8_t row = 0;
  std::uint8_t vertices = 0;                        ///< of the patch's ring or the null patch's face
  std::array<std::uint8_t, kMaxPatchSize> state{};  ///< of each afterwards: how open it is, its valence
  SymbolInputs input;                               ///< features, see hypothesis.cpp
  Patch patch;                                      ///< unless it is the null patch
  float face_area = 0;                              ///< expected of each of its new faces
  float spoke = 0;                                  ///< expected length of its new edges
};

/// States of a vertex after a decision: faces at it that are still undecided (0, 1, 2, more) and valence.
inline constexpr std::size_t kVertexStates = 4 * 10;

/// What one pass knows of the coarse faces and of those that are refined already. One object serves one pass.
class Surroundings {
 public:
  /// REQUIRES: no face of the pass is decided yet. `previous` is the first vertex that the pass before inserted.
  /// [linear in the faces]
  Surroundings(const HalfEdgeMesh& mesh, std::span<const LatticePoint> points, PassKind kind, std::uint32_t previous);

  /// All that could stand before the gate; the null patch comes first, then border patches, then 6 to 3. The answer
  /// holds until the next call. [constant]
  std::span<Hypothesis> look(const HalfEdgeMesh& mesh, std::span<const LatticePoint> points, const Marks& marks,
                             std::uint32_t gate, Tag tag_s, Tag tag_t);

  /// The gate's face stays as it is. Call it before anything is marked.
  void keep(const HalfEdgeMesh& mesh, std::uint32_t gate);
  /// The hypothesis' patch was opened and its centre, the newest vertex, inserted.
  void insert(const Hypothesis& hypothesis, const Triangulation& triangulation);

  /// Faces at v that are still undecided.
  [[nodiscard]] std::uint32_t open(std::uint32_t v) const { return vertex_[v].open; }

 private:
  struct FaceShape {
    float x = 0;  // area times normal
    float y = 0;
    float z = 0;
    float area = 0;
  };
  // Sums over the refined faces at a vertex.
  struct VertexSums {
    float area = 0;
    float perimeter = 0;
    float faces = 0;
    std::uint32_t open = 0;
  };
  struct Scale {
    float log_area = 0;  // log2 of the mean refined face at the gate, and of the mean refined edge
    float log_edge = 0;
    float edge = 0;
  };

  void add_face(VertexSums& sums, float area, float perimeter) const {
    sums.area += area;
    sums.perimeter += perimeter;
    sums.faces += 1;
  }
  [[nodiscard]] std::uint8_t state_of(const HalfEdgeMesh& mesh, std::uint32_t v, unsigned closed, int change) const;
  void describe_null(const HalfEdgeMesh& mesh, std::span<const LatticePoint> points, const Marks& marks,
                     std::uint32_t gate, const Scale& scale, Hypothesis& hypothesis) const;
  void describe_patch(const HalfEdgeMesh& mesh, std::span<const LatticePoint> points, const Marks& marks,
                      const Triangulation& triangulation, const Scale& scale, Hypothesis& hypothesis) const;

  PassKind kind_;
  std::uint32_t previous_;
  bool has_boundary_ = false;
  std::vector<FaceShape> face_;
  std::vector<float> length_;  // by half-edge
  std::vector<VertexSums> vertex_;
  VertexSums all_;  // over the whole pass, fading
  std::array<Hypothesis, kSymbolRows> hypothesis_;
};

}  // namespace pmcd::codec
