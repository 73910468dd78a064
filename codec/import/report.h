// SPDX-License-Identifier: GPL-3.0-or-later
// What import did with a file, in numbers and in lines for a person. Everything that is not the file's own content,
// bit for bit, stands in it.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace pmcd::import {

/// "1 face", "2 faces".
std::string counted(std::uint64_t n, const std::string& one, const std::string& many);

struct ImportReport {
  std::string format;    ///< for instance "PLY, binary little endian"
  bool float64 = false;  ///< coordinates are kept as double
  std::uint64_t vertices_in_file = 0;
  std::uint64_t polygons_in_file = 0;
  std::uint64_t vertices = 0;  ///< of the mesh that results
  std::uint64_t faces = 0;
  std::vector<std::string> left_out;        ///< data that the mesh has no room for, by name
  std::uint64_t corners_welded = 0;         ///< STL: vertices that became one with an earlier one of equal bits
  std::uint64_t polygons_triangulated = 0;  ///< with more than three corners
  std::uint64_t diagonals_avoided = 0;      ///< of these, cut elsewhere because an edge was there already
  std::uint64_t polygons_not_simple = 0;    ///< of these, cut without regard to their shape
  std::uint64_t faces_turned = 0;
  std::uint64_t components_with_turned_faces = 0;
  std::uint64_t isolated_vertices = 0;  ///< kept
  std::uint64_t zero_area_faces = 0;    ///< kept

  /// What there is to tell, a line each, no line ends; the first says what the file holds.
  [[nodiscard]] std::vector<std::string> lines() const;
};

}  // namespace pmcd::import
