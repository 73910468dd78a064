// SPDX-License-Identifier: GPL-3.0-or-later
// From polygons as they stand in a file to a mesh that the encoder takes.
#include <algorithm>
#include <optional>
#include <string>

#include "codec/import/defects.h"
#include "codec/import/read_mesh.h"
#include "codec/import/repair.h"
#include "codec/import/triangulate.h"
#include "codec/mesh/edge_table.h"

namespace pmcd::import {
namespace {

using codec::Face;
using codec::Position;

std::string joined(const std::vector<std::string>& names) {
  std::string out;
  for (const std::string& name : names) out += (out.empty() ? "" : "; ") + name;
  return out;
}

std::string how_many(std::uint64_t n, const char* one, const char* many) {
  return std::to_string(n) + " " + (n == 1 ? one : many);
}

std::string in_words(const Defect& defect) {
  switch (defect.code) {
    case ImportErrorCode::duplicate_face:
      return how_many(defect.count, "duplicate face", "duplicate faces");
    case ImportErrorCode::non_manifold_edge:
      return how_many(defect.count, "edge with more than two faces", "edges with more than two faces");
    default:
      return how_many(defect.count, "vertex whose faces form more than one fan",
                      "vertices whose faces form more than one fan");
  }
}

bool has_zero_area(const Position& a, const Position& b, const Position& c) {
  for (std::size_t k = 0; k < 3; ++k) {
    const std::size_t u = (k + 1) % 3;
    const std::size_t v = (k + 2) % 3;
    if ((b[u] - a[u]) * (c[v] - a[v]) != (b[v] - a[v]) * (c[u] - a[u])) return false;
  }
  return true;
}

class Preparation {
 public:
  Preparation(RawMesh raw, std::span<const std::byte> bytes, const ImportOptions& options)
      : raw_(std::move(raw)), bytes_(bytes), options_(options) {}

  ImportResult<ImportedMesh> run() {
    ImportedMesh out;
    ImportReport& report = out.report;
    report.format = raw_.format;
    report.float64 = raw_.scalar == codec::Scalar::float64;
    report.vertices_in_file = raw_.positions.size();
    report.polygons_in_file = raw_.polygon_end.size();
    report.left_out = raw_.left_out;
    if (options_.strict && !raw_.left_out.empty()) {
      ImportError error;
      error.code = ImportErrorCode::left_out;
      error.count = raw_.left_out.size();
      error.message = "would leave out " + joined(raw_.left_out) + "; remove these data or read without strict";
      return error;
    }
    if (ImportFailure failure = check_indices()) return std::move(*failure);
    if (raw_.corners_stand_alone)
      report.corners_welded = weld_equal_bits(raw_.positions, raw_.vertex_place, raw_.corners);
    if (ImportFailure failure = check_repeated()) return std::move(*failure);

    Triangulation triangulation = triangulate(raw_.positions, raw_.corners, raw_.polygon_end);
    polygon_of_face_ = std::move(triangulation.polygon);
    report.polygons_triangulated = triangulation.polygons;
    report.diagonals_avoided = triangulation.diagonals_avoided;
    report.polygons_not_simple = triangulation.not_simple;
    std::vector<Face>& faces = triangulation.faces;

    const codec::EdgeTable edges(faces, raw_.positions.size());
    const std::vector<Defect> defects = find_defects(faces, raw_.positions.size(), edges);
    if (!defects.empty()) return refusal(defects);
    const Orientation orientation = orient(faces, edges);
    if (orientation.conflicts > 0) return not_orientable(orientation);
    report.faces_turned = orientation.faces_turned;
    report.components_with_turned_faces = orientation.components_touched;

    count_oddities(faces, report);
    report.vertices = raw_.positions.size();
    report.faces = faces.size();
    out.mesh.scalar = raw_.scalar;
    out.mesh.positions = std::move(raw_.positions);
    out.mesh.faces = std::move(faces);
    return out;
  }

 private:
  [[nodiscard]] ImportError at_polygon(ImportErrorCode code, std::size_t polygon, std::string message) const {
    ImportError error = polygon < raw_.polygon_place.size()
                            ? error_at(code, bytes_, raw_.polygon_place[polygon], raw_.text, std::move(message))
                            : ImportError{code, std::move(message), {}, {}, {}, {}, 0};
    error.element = polygon;
    return error;
  }

  [[nodiscard]] std::size_t polygon_of(std::uint32_t face) const {
    return polygon_of_face_.empty() ? face : polygon_of_face_[face];
  }

  [[nodiscard]] static std::string face_name(std::size_t polygon) {
    return "face " + std::to_string(polygon) + " (counted from 0)";
  }

  ImportFailure check_indices() const {
    std::size_t begin = 0;
    for (std::size_t p = 0; p < raw_.polygon_end.size(); ++p) {
      for (std::size_t i = begin; i < raw_.polygon_end[p]; ++i) {
        if (raw_.corners[i] < raw_.positions.size()) continue;
        return at_polygon(ImportErrorCode::index_out_of_range, p,
                          face_name(p) + ": corner " + std::to_string(i - begin) +
                              " names a vertex that the file, with " + std::to_string(raw_.positions.size()) +
                              " vertices, does not have; correct the face");
      }
      begin = raw_.polygon_end[p];
    }
    return {};
  }

  ImportFailure check_repeated() const {
    std::uint64_t count = 0;
    std::size_t first = 0;
    std::size_t begin = 0;
    std::vector<std::uint32_t> sorted;
    for (std::size_t p = 0; p < raw_.polygon_end.size(); ++p) {
      sorted.assign(raw_.corners.begin() + static_cast<std::ptrdiff_t>(begin),
                    raw_.corners.begin() + raw_.polygon_end[p]);
      std::sort(sorted.begin(), sorted.end());
      if (std::adjacent_find(sorted.begin(), sorted.end()) != sorted.end()) {
        if (count++ == 0) first = p;
      }
      begin = raw_.polygon_end[p];
    }
    if (count == 0) return {};
    ImportError error = at_polygon(ImportErrorCode::repeated_index_in_face, first,
                                   how_many(count, "face names", "faces name") + " the same vertex twice, first " +
                                       face_name(first) + "; remove such faces");
    error.count = count;
    return error;
  }

  /// Tells all kinds of defects, named after the first and placed at it.
  [[nodiscard]] ImportError refusal(const std::vector<Defect>& defects) const {
    std::string message;
    for (const Defect& defect : defects) message += (message.empty() ? "" : ", ") + in_words(defect);
    const Defect& first = defects.front();
    ImportError error;
    if (first.code == ImportErrorCode::non_manifold_vertex) {
      message += ", first vertex " + std::to_string(first.first) + " (counted from 0)";
      if (first.first < raw_.vertex_place.size()) {
        error = error_at(first.code, bytes_, raw_.vertex_place[first.first], raw_.text, {});
      }
      error.code = first.code;
      error.element = first.first;
    } else {
      const std::size_t polygon = polygon_of(first.first);
      message += ", first " + face_name(polygon);
      error = at_polygon(first.code, polygon, {});
    }
    error.message = message + "; the mesh is not manifold, repair it";
    error.count = first.count;
    return error;
  }

  [[nodiscard]] ImportError not_orientable(const Orientation& orientation) const {
    const std::size_t polygon = polygon_of(orientation.conflict_face.value_or(0));
    ImportError error = at_polygon(ImportErrorCode::not_orientable, polygon,
                                   "the surface is one-sided: its faces cannot all be turned to agree, first at " +
                                       face_name(polygon) + "; cut it open there");
    error.count = orientation.conflicts;
    return error;
  }

  void count_oddities(const std::vector<Face>& faces, ImportReport& report) const {
    std::vector<bool> used(raw_.positions.size(), false);
    for (const Face& face : faces) {
      for (const std::uint32_t v : face) used[v] = true;
      const std::vector<Position>& p = raw_.positions;
      report.zero_area_faces += has_zero_area(p[face[0]], p[face[1]], p[face[2]]) ? 1 : 0;
    }
    report.isolated_vertices = static_cast<std::uint64_t>(std::count(used.begin(), used.end(), false));
  }

  RawMesh raw_;
  std::span<const std::byte> bytes_;
  ImportOptions options_;
  std::vector<std::uint32_t> polygon_of_face_;
};

}  // namespace

ImportResult<ImportedMesh> prepare(RawMesh raw, std::span<const std::byte> bytes, const ImportOptions& options) {
  return Preparation(std::move(raw), bytes, options).run();
}

}  // namespace pmcd::import
