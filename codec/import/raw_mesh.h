// SPDX-License-Identifier: GPL-3.0-or-later
// What a reader makes of a file: positions and polygons as they stand there, with the place of each in the file so that
// a later complaint about the mesh can still name a line or byte. Nothing is repaired or refused here; prepare.h does.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "codec/import/error.h"
#include "codec/import/text.h"
#include "codec/mesh/triangle_mesh.h"

namespace pmcd::import {

struct ReadOptions {
  bool as_double = false;  ///< text coordinates become the nearest double instead of the nearest float32
};

struct RawMesh {
  std::string format;  ///< for people, for instance "PLY, binary little endian"
  codec::Scalar scalar = codec::Scalar::float32;
  std::vector<codec::Position> positions;   ///< all finite
  std::vector<std::uint32_t> corners;       ///< of all polygons, one after the other; not yet checked against positions
  std::vector<std::uint32_t> polygon_end;   ///< end of each polygon in corners; each has three corners or more
  std::vector<std::uint64_t> vertex_place;  ///< byte of the file at which each vertex starts
  std::vector<std::uint64_t> polygon_place;  ///< the same for polygons
  std::vector<std::string> left_out;         ///< data of the file that a TriangleMesh has no room for, by name
  bool text = true;                          ///< places are told as lines
  bool corners_stand_alone = false;          ///< STL: three vertices a face, to be welded
};

/// Each reader takes the whole file, trusts no count in it (what it allocates is bounded by the bytes that are there)
/// and sets every part of an error but its file. Time: linear in the bytes.
ImportResult<RawMesh> read_ply(std::span<const std::byte> bytes, const ReadOptions& options);
ImportResult<RawMesh> read_obj(std::span<const std::byte> bytes, const ReadOptions& options);
ImportResult<RawMesh> read_off(std::span<const std::byte> bytes, const ReadOptions& options);
ImportResult<RawMesh> read_stl(std::span<const std::byte> bytes, const ReadOptions& options);

inline std::string_view as_text(std::span<const std::byte> bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

/// An error at a byte of a file, told as a line if the file is text.
ImportError error_at(ImportErrorCode code, std::span<const std::byte> bytes, std::uint64_t place, bool text,
                     std::string message);

/// The error of a token that parse_coordinate refused, in the line at `place`.
ImportError coordinate_error(NumberProblem problem, std::string_view token, codec::Scalar scalar,
                             std::span<const std::byte> bytes, std::uint64_t place, std::uint64_t vertex);

/// More vertices or corners than 32-bit indices can name.
ImportError too_large_error(std::span<const std::byte> bytes, std::uint64_t place, bool text);

/// Adds a vertex or a polygon; false if 32-bit indices cannot name it.
bool add_vertex(RawMesh& mesh, const codec::Position& position, std::uint64_t place);
/// Ends the polygon whose corners were appended to mesh.corners since the last end.
bool end_polygon(RawMesh& mesh, std::uint64_t place);

}  // namespace pmcd::import
