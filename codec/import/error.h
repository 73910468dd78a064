// SPDX-License-Identifier: GPL-3.0-or-later
// Errors of import and export as values: what is wrong with the user's file or mesh, where in the file, and what to do
// about it. The numbers of the codec's own errors (codec/result.h) are another list.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "codec/result.h"

namespace pmcd::import {

// The numbers stand in tools' JSON: never change or reuse one.
enum class ImportErrorCode : std::uint16_t {
  // The file.
  cannot_read = 1,               ///< the operating system refused
  cannot_write = 2,              ///< the operating system refused, or the format cannot hold the mesh
  unknown_extension = 3,         ///< the name does not say which format
  empty_file = 4,                ///< no bytes at all
  compressed = 5,                ///< packed by gzip or another packer
  wrong_format = 6,              ///< the content is not of the format that the name says
  unsupported_variant = 7,       ///< the right format, in a variant that pmcd does not read
  truncated = 8,                 ///< the file ends before what it promises
  trailing_data = 9,             ///< the file goes on after what it promises
  malformed = 10,                ///< a line or value that the format does not allow
  non_finite_coordinate = 11,    ///< NaN or infinity
  coordinate_out_of_range = 12,  ///< too large for the scalar type
  index_out_of_range = 13,       ///< a face names a vertex that does not exist
  too_few_corners = 14,          ///< a face with one or two corners
  too_large = 15,                ///< more vertices or corners than 32-bit indices can name
  // The mesh.
  repeated_index_in_face = 20,  ///< a face names the same vertex twice
  duplicate_face = 21,          ///< two faces with the same three vertices, in whatever order
  non_manifold_edge = 22,       ///< more than two faces at an edge
  non_manifold_vertex = 23,     ///< the faces at a vertex form more than one fan
  not_orientable = 24,          ///< the faces cannot be turned so that they agree
  // The request.
  left_out = 30,         ///< strict was asked for and the file has data that a mesh packet cannot hold
  invalid_option = 31,   ///< an option of the encoder is outside its range
  cancelled = 32,        ///< the caller asked to stop
  encoder_refused = 40,  ///< the codec's encoder refused the mesh
  bad_packet_file = 41,  ///< a .pmcd file that the codec refuses
};

/// The stable name of a code, for instance "non_manifold_edge". Never null.
const char* error_name(ImportErrorCode code);

struct ImportError {
  ImportErrorCode code = ImportErrorCode::malformed;
  std::string message;                   ///< plain words: what is wrong, then what to do
  std::string file;                      ///< as the caller named it; empty if there is none
  std::optional<std::uint64_t> line;     ///< of a text file, counted from 1
  std::optional<std::uint64_t> byte;     ///< of a binary file, counted from 0
  std::optional<std::uint64_t> element;  ///< vertex or face (the message says which), counted from 0
  std::uint64_t count = 0;               ///< how often, for what is wrong with the mesh
};

/// One line for a person: "bunny.ply:17: ... [malformed]" or "bunny.ply: byte 300: ... [truncated]".
std::string to_line(const ImportError& error);

template <typename T>
using ImportResult = codec::Result<T, ImportError>;

/// Success without a value, or an ImportError: empty means success.
using ImportFailure = std::optional<ImportError>;

}  // namespace pmcd::import
