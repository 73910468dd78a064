// SPDX-License-Identifier: GPL-3.0-or-later
// Positions first, then faces as triples of positions, and only if those agree and positions repeat, the matching.
#include "codec/import/compare.h"

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cstdint>

#include "codec/import/matching.h"
#include "codec/import/text.h"

namespace pmcd::import {
namespace {

using codec::Face;
using codec::Position;
using codec::TriangleMesh;

constexpr std::size_t kMostExamples = 3;

std::string in_words(const Position& p) {
  std::string out = "(";
  for (std::size_t k = 0; k < 3; ++k) {
    std::array<char, 40> buffer;
    const bool narrow = is_float32(p[k]);
    const auto [end, problem] =
        narrow ? std::to_chars(buffer.data(), buffer.data() + buffer.size(), static_cast<float>(p[k]))
               : std::to_chars(buffer.data(), buffer.data() + buffer.size(), p[k]);
    if (k > 0) out += ' ';
    out.append(buffer.data(), problem == std::errc{} ? end : buffer.data());
  }
  return out.append(")");
}

struct Vertex {
  std::array<std::uint64_t, 3> bits;
  std::uint32_t index;
  bool in_b;
};

std::vector<Vertex> vertices_by_bits(const TriangleMesh& a, const TriangleMesh& b) {
  std::vector<Vertex> vertices;
  vertices.reserve(a.positions.size() + b.positions.size());
  const auto add = [&](const std::vector<Position>& positions, bool in_b) {
    for (std::uint32_t v = 0; v < positions.size(); ++v) {
      const Position& p = positions[v];
      vertices.push_back(
          {{std::bit_cast<std::uint64_t>(p[0]), std::bit_cast<std::uint64_t>(p[1]), std::bit_cast<std::uint64_t>(p[2])},
           v,
           in_b});
    }
  };
  add(a.positions, false);
  add(b.positions, true);
  std::sort(vertices.begin(), vertices.end(), [](const Vertex& x, const Vertex& y) {
    if (x.bits != y.bits) return x.bits < y.bits;
    return x.in_b != y.in_b ? y.in_b : x.index < y.index;
  });
  return vertices;
}

/// The corner triple turned so that it is smallest: equal for triples that are cyclic shifts of each other.
Face canonical(const Face& face) {
  return std::min({face, Face{face[1], face[2], face[0]}, Face{face[2], face[0], face[1]}});
}

std::vector<Face> canonical_sorted(const std::vector<Face>& faces, const std::vector<std::uint32_t>& name) {
  std::vector<Face> out;
  out.reserve(faces.size());
  for (const Face& f : faces) out.push_back(canonical({name[f[0]], name[f[1]], name[f[2]]}));
  std::sort(out.begin(), out.end());
  return out;
}

class Comparer {
 public:
  Comparer(const TriangleMesh& a, const TriangleMesh& b, const std::string& name_a, const std::string& name_b)
      : a_(a), b_(b), name_a_(name_a), name_b_(name_b) {}

  Comparison run() {
    classify();
    compare_counts();
    const bool same_positions = only_a_ == 0 && only_b_ == 0;
    const bool same_faces = compare_faces();
    // Two equal numbers of equal things: what is left is how vertices at one position share the faces there.
    if (same_positions && same_faces && positions_repeat_) compare_connections();
    Comparison result;
    result.same = differences_.empty();
    result.differences = std::move(differences_);
    return result;
  }

 private:
  void compare_counts() {
    const auto differ = [&](const char* what, std::size_t x, std::size_t y) {
      if (x == y) return;
      differences_.push_back(std::to_string(x) + " " + what + " in " + name_a_ + ", " + std::to_string(y) + " in " +
                             name_b_);
    };
    differ("vertices", a_.positions.size(), b_.positions.size());
    differ("faces", a_.faces.size(), b_.faces.size());
    report("vertices", only_a_, name_a_, examples_a_);
    report("vertices", only_b_, name_b_, examples_b_);
  }

  void report(const std::string& what, std::uint64_t count, const std::string& where,
              const std::vector<std::string>& examples) {
    if (count == 0) return;
    std::string line = std::to_string(count) + " " + what + " only in " + where + ", such as ";
    for (std::size_t i = 0; i < examples.size(); ++i) line += (i > 0 ? ", " : "") + examples[i];
    differences_.push_back(line);
  }

  /// Gives equal positions of both meshes the same class and finds the positions that one mesh has more often.
  void classify() {
    const std::vector<Vertex> vertices = vertices_by_bits(a_, b_);
    class_a_.resize(a_.positions.size());
    class_b_.resize(b_.positions.size());
    for (std::size_t i = 0; i < vertices.size();) {
      std::size_t end = i;
      std::size_t in_b = 0;
      while (end < vertices.size() && vertices[end].bits == vertices[i].bits) {
        const Vertex& v = vertices[end];
        (v.in_b ? class_b_ : class_a_)[v.index] = classes_;
        in_b += v.in_b ? 1 : 0;
        ++end;
      }
      const std::size_t in_a = end - i - in_b;
      positions_repeat_ = positions_repeat_ || in_a > 1;
      const Position& place = vertices[i].in_b ? b_.positions[vertices[i].index] : a_.positions[vertices[i].index];
      place_.push_back(place);
      note_surplus(in_a, in_b, place, only_a_, examples_a_);
      note_surplus(in_b, in_a, place, only_b_, examples_b_);
      ++classes_;
      i = end;
    }
  }

  static void note_surplus(std::size_t here, std::size_t there, const Position& place, std::uint64_t& only,
                           std::vector<std::string>& examples) {
    if (here <= there) return;
    only += here - there;
    if (examples.size() >= kMostExamples) return;
    const std::string often = there == 0 ? ""
                                         : std::string(" (").append(std::to_string(here)) + " there, " +
                                               std::to_string(there) + " in the other)";
    examples.push_back(in_words(place) + often);
  }

  [[nodiscard]] std::string face_in_words(const Face& classes) const {
    std::string out = "[";
    for (std::size_t c = 0; c < 3; ++c) out.append(c > 0 ? " " : "").append(in_words(place_[classes[c]]));
    return out.append("]");
  }

  /// Faces as triples of positions, with multiplicity.
  bool compare_faces() {
    const std::vector<Face> faces_a = canonical_sorted(a_.faces, class_a_);
    const std::vector<Face> faces_b = canonical_sorted(b_.faces, class_b_);
    if (faces_a == faces_b) return true;
    const auto only_in = [&](const std::vector<Face>& here, const std::vector<Face>& there, const std::string& name) {
      std::vector<Face> only;
      std::set_difference(here.begin(), here.end(), there.begin(), there.end(), std::back_inserter(only));
      std::vector<std::string> examples;
      for (std::size_t i = 0; i < std::min(only.size(), kMostExamples); ++i) examples.push_back(face_in_words(only[i]));
      report("faces", only.size(), name, examples);
    };
    only_in(faces_a, faces_b, name_a_);
    only_in(faces_b, faces_a, name_b_);
    return false;
  }

  void compare_connections() {
    const MatchingProblem problem{a_.faces, b_.faces, class_a_, class_b_, classes_};
    const Matching matching = match_vertices(problem);
    if (!matching.found) {
      std::string line = "vertices at the same position are connected differently";
      if (matching.stuck_a) line += ", first at " + in_words(a_.positions[*matching.stuck_a]);
      if (matching.stuck_b) line += ", first at " + in_words(b_.positions[*matching.stuck_b]);
      differences_.push_back(line);
      return;
    }
    std::vector<std::uint32_t> itself(b_.positions.size());
    for (std::uint32_t v = 0; v < itself.size(); ++v) itself[v] = v;
    if (canonical_sorted(a_.faces, matching.image) != canonical_sorted(b_.faces, itself)) {
      differences_.emplace_back("vertices at the same position are connected differently");
    }
  }

  const TriangleMesh& a_;
  const TriangleMesh& b_;
  const std::string& name_a_;
  const std::string& name_b_;
  std::vector<std::uint32_t> class_a_;
  std::vector<std::uint32_t> class_b_;
  std::vector<Position> place_;  ///< of each class
  std::uint32_t classes_ = 0;
  bool positions_repeat_ = false;
  std::uint64_t only_a_ = 0;
  std::uint64_t only_b_ = 0;
  std::vector<std::string> examples_a_;
  std::vector<std::string> examples_b_;
  std::vector<std::string> differences_;
};

}  // namespace

Comparison compare_meshes(const TriangleMesh& a, const TriangleMesh& b, const std::string& name_a,
                          const std::string& name_b) {
  return Comparer(a, b, name_a, name_b).run();
}

}  // namespace pmcd::import
