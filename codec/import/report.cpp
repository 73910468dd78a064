// SPDX-License-Identifier: GPL-3.0-or-later
// The import report in words.
#include "codec/import/report.h"

namespace pmcd::import {

std::string counted(std::uint64_t n, const std::string& one, const std::string& many) {
  return std::to_string(n) + " " + (n == 1 ? one : many);
}

std::vector<std::string> ImportReport::lines() const {
  std::vector<std::string> out;
  out.push_back(format + ": " + counted(vertices_in_file, "vertex", "vertices") + ", " +
                counted(polygons_in_file, "face", "faces") + ", coordinates as " + (float64 ? "double" : "float32"));
  if (corners_welded > 0) {
    out.push_back(counted(corners_welded, "corner", "corners") + " of equal bits welded, " +
                  counted(vertices, "vertex", "vertices") + " left");
  }
  if (polygons_triangulated > 0) {
    std::string line = counted(polygons_triangulated, "polygon", "polygons") + " triangulated, " +
                       counted(faces, "face", "faces") + " now";
    if (diagonals_avoided > 0) line += "; " + std::to_string(diagonals_avoided) + " cut around existing edges";
    if (polygons_not_simple > 0) line += "; " + std::to_string(polygons_not_simple) + " not simple in their plane";
    out.push_back(line);
  }
  if (faces_turned > 0) {
    out.push_back(counted(faces_turned, "face", "faces") + " turned to agree with the neighbours, in " +
                  counted(components_with_turned_faces, "component", "components"));
  }
  if (isolated_vertices > 0)
    out.push_back(counted(isolated_vertices, "isolated vertex", "isolated vertices") + " kept");
  if (zero_area_faces > 0) out.push_back(counted(zero_area_faces, "face", "faces") + " of zero area kept");
  for (const std::string& name : left_out) out.push_back("left out: " + name);
  return out;
}

}  // namespace pmcd::import
