// SPDX-License-Identifier: GPL-3.0-or-later
// What all readers share: places in the file, and the size that 32-bit indices allow.
#include "codec/import/raw_mesh.h"

#include <limits>

namespace pmcd::import {

ImportError error_at(ImportErrorCode code, std::span<const std::byte> bytes, std::uint64_t place, bool text,
                     std::string message) {
  ImportError error;
  error.code = code;
  error.message = std::move(message);
  if (text) {
    error.line = line_of(as_text(bytes), place);
  } else {
    error.byte = place;
  }
  return error;
}

ImportError coordinate_error(NumberProblem problem, std::string_view token, codec::Scalar scalar,
                             std::span<const std::byte> bytes, std::uint64_t place, std::uint64_t vertex) {
  const std::string who = "vertex " + std::to_string(vertex) + " (counted from 0): ";
  ImportError error;
  switch (problem) {
    case NumberProblem::non_finite:
      error = error_at(ImportErrorCode::non_finite_coordinate, bytes, place, true,
                       who + "coordinate " + shown(token) + " is not finite; correct or remove the vertex");
      break;
    case NumberProblem::out_of_range:
      error = error_at(ImportErrorCode::coordinate_out_of_range, bytes, place, true,
                       who + "coordinate " + shown(token) +
                           (scalar == codec::Scalar::float32
                                ? " is too large for a 32-bit float; read the file as double or scale the mesh down"
                                : " is too large for a double; scale the mesh down"));
      break;
    case NumberProblem::none:
    case NumberProblem::malformed:
      error = error_at(ImportErrorCode::malformed, bytes, place, true,
                       who + (token.empty() ? std::string("has fewer than three coordinates; add what is missing")
                                            : shown(token) + " is not a number; correct the line"));
      break;
  }
  error.element = vertex;
  return error;
}

ImportError too_large_error(std::span<const std::byte> bytes, std::uint64_t place, bool text) {
  return error_at(ImportErrorCode::too_large, bytes, place, text,
                  "more vertices or faces than 32-bit indices can name; split the mesh");
}

bool add_vertex(RawMesh& mesh, const codec::Position& position, std::uint64_t place) {
  if (mesh.positions.size() >= std::numeric_limits<std::uint32_t>::max() - 1) return false;
  mesh.positions.push_back(position);
  mesh.vertex_place.push_back(place);
  return true;
}

bool end_polygon(RawMesh& mesh, std::uint64_t place) {
  // A polygon of n corners becomes n - 2 triangles, so 3 * triangles stays below three times the corners.
  if (mesh.corners.size() >= std::numeric_limits<std::uint32_t>::max() / 3) return false;
  mesh.polygon_end.push_back(static_cast<std::uint32_t>(mesh.corners.size()));
  mesh.polygon_place.push_back(place);
  return true;
}

}  // namespace pmcd::import
