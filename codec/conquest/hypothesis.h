// SPDX-License-Identifier: MIT
// What could stand before a gate, each possibility with what the geometry says of it: a vertex that was removed leaves
// faces too large and diagonals too long against the refined faces nearby, its patch and not another would bring the
// valences right, and parallelograms over refined neighbours point at where it was. The gate's face can be looked at
// alone first, which is cheap; patches need what collect_polygon and the whole ring tell.
// Geometry that predicts connectivity goes back to Lewiner et al. (GEncode, 2004) and Kaelberer et al. (FreeLence,
// 2005); these features are ours. What the bits a vertex would grow by without them, on seven meshes: diagonals 0.06,
// parallelograms 0.05, sums of valences, largest and smallest face 0.015 each, others about 0.01 or less.
// It neither decides nor codes (symbol_model.h does).
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

/// States of a vertex after a decision: faces at it that are still undecided (0, 1, 2, more) and valence.
inline constexpr std::size_t kVertexStates = 4 * 10;
inline constexpr std::uint8_t kNoVertex = kVertexStates;  ///< where there are fewer

/// What tells whether the face before the gate stays as it is: features of the face and of the two beyond it, and of
/// s, t, the front and the apexes of those two by the tag that they have: how open they are, their valence.
inline constexpr std::size_t kFaceInputs = 32;
using FaceInputs = Lanes<kFaceInputs>;
inline constexpr std::size_t kFaceCorners = 5;
inline constexpr std::size_t kCornerStates = kFaceCorners * 3 * kVertexStates;
inline constexpr std::uint16_t kNoCorner = kCornerStates;  ///< nothing undecided lies beyond
struct FaceView {
  FaceInputs input;  ///< features, see face_view.cpp
  std::array<std::uint16_t, kFaceCorners> corner{};
};

/// What could stand before the gate.
struct Hypothesis {
  Symbol symbol = kNull;
  std::uint8_t row = 0;
  /// Of each vertex of the patch's ring or the null patch's face afterwards: how open it is, its valence.
  std::array<std::uint8_t, kMaxPatchSize> state{};
  SymbolInputs input;   ///< features, see hypothesis.cpp
  Patch patch;          ///< unless it is the null patch
  float log_area = 0;   ///< expected of each of its new faces
  float log_spoke = 0;  ///< expected of its new edges
};

/// What one pass knows of the coarse faces and of those that are refined already. One object serves one pass.
class Surroundings {
 public:
  /// REQUIRES: no face of the pass is decided yet. `previous` is the first vertex that the pass before inserted; there
  /// will be `most_vertices` at most. [linear in the faces]
  Surroundings(const HalfEdgeMesh& mesh, std::span<const LatticePoint> points, PassKind kind, std::uint32_t previous,
               std::uint32_t most_vertices);

  /// What speaks for the null patch or against it. The answer holds until the next call. [constant]
  const FaceView& look_at_face(const HalfEdgeMesh& mesh, const Marks& marks, std::uint32_t gate);

  /// The null patch; its features are those of the last call of look().
  [[nodiscard]] const Hypothesis& null() const { return hypothesis_[0]; }

  /// All that could stand before the gate; the null patch comes first, then border patches, then 6 to 3. The answer
  /// holds until the next call. REQUIRES: look_at_face was asked of this gate last. [constant]
  std::span<const Hypothesis> look(const HalfEdgeMesh& mesh, const Marks& marks, std::uint32_t gate, Tag tag_s,
                                   Tag tag_t);

  /// The gate's face stays as it is. Call it before anything is marked.
  void keep(const HalfEdgeMesh& mesh, std::uint32_t gate);
  /// The hypothesis' patch was opened and its centre, the newest vertex, inserted at `position`.
  void insert(const Hypothesis& hypothesis, const Triangulation& triangulation, const LatticePoint& position);

 private:
  // Logarithms are to base 2; 20 bytes, for the walk over the faces is a walk over memory.
  struct FaceShape {
    float area = 0;
    float log_area = 0;
    std::array<float, 3> log_length{};  // by edge
  };
  // Sums over the refined faces at a vertex.
  struct Vertex {
    Four position{};
    float log_area = 0;
    float log_length = 0;  // mean of a face's edges
    std::uint16_t faces = 0;
    std::uint16_t open = 0;     // faces that are undecided
    std::uint16_t valence = 0;  // in faces, a boundary vertex as if three more closed it
    std::uint16_t brief = 0;    // of the two before, as far as outcomes depend on them
  };
  // Sums over the whole pass, fading.
  struct Pass {
    float log_area = 0;
    float log_length = 0;  // mean of a face's edges
    float faces = 0;
  };
  // Of the refined faces at the gate: what the features are measured in.
  struct Scale {
    float log_area = 0;
    float log_edge = 0;
    float per_edge_squared = 0;
    float log_area_s = 0;
    float log_area_t = 0;
  };

  template <typename Sums>
  static void add_face(Sums& at, float log_area, float log_length) {
    at.log_area += log_area;
    at.log_length += log_length;
    ++at.faces;
  }
  // `faces` of it were decided, its valence grew.
  static void change(Vertex& at, unsigned faces, int growth);
  // Faces that the star of a patch has at ring vertex i.
  static int star_faces(const Patch& patch, unsigned i) {
    return patch.is_border() && (i == patch.closing || i == patch.closing + 1) ? 1 : 2;
  }
  [[nodiscard]] float log_length(std::uint32_t h) const {
    return face_[HalfEdgeMesh::face_of(h)].log_length[HalfEdgeMesh::edge_of(h)];
  }
  void fade(float by);
  void describe_null(std::uint32_t s, std::uint32_t t, std::uint32_t front);
  [[nodiscard]] std::uint16_t corner_of(std::uint32_t v, std::size_t place, Tag tag) const;
  [[nodiscard]] Scale measure(std::uint32_t s, std::uint32_t t, std::uint32_t front) const;
  template <unsigned kSize, bool kIsBorder>
  void describe_patch(const HalfEdgeMesh& mesh, const Marks& marks, const Triangulation& triangulation,
                      Hypothesis& hypothesis) const;

  PassKind kind_;
  std::uint32_t previous_;
  bool has_boundary_ = false;
  std::vector<FaceShape> face_;
  std::vector<Vertex> vertex_;
  Pass all_;
  Scale scale_;  // of the gate that is looked at
  FaceView face_view_;
  std::array<Hypothesis, kSymbolRows> hypothesis_;
};

}  // namespace pmcd::codec
