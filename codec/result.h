// SPDX-License-Identifier: MIT
// Errors as values: what is wrong with the user's mesh or packet, where, and in words. The codec throws nothing, so
// every function that can refuse its input returns a Result. This file knows no I/O and formats no file names.
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <variant>

namespace pmcd::codec {

// The numbers stand in tools' JSON and in logs: never change or reuse one.
enum class ErrorCode : std::uint16_t {
  // The mesh given to the encoder.
  index_out_of_range = 1,      ///< a face names a vertex that does not exist; where = face
  non_finite_coordinate = 2,   ///< NaN or infinite coordinate; where = vertex
  repeated_index_in_face = 3,  ///< a face names the same vertex twice; where = face
  duplicate_face = 4,          ///< two faces have the same three vertices; where = the second face
  non_manifold_edge = 5,       ///< more than two faces meet at an edge; where = a face at it
  non_manifold_vertex = 6,     ///< the faces at a vertex form more than one fan; where = vertex
  opposing_faces = 7,          ///< two neighbouring faces are turned against each other; where = a face
  mesh_too_large = 8,          ///< more vertices or faces than 32-bit half-edge indices can name
  extent_too_large = 9,        ///< the bounding box is wider than the scalar type can express; where = axis
  not_representable = 10,      ///< a coordinate of a float32 mesh is not a float32 value; where = vertex
  invalid_option = 11,         ///< an encoder option is outside its range
  cancelled = 12,              ///< the caller's progress callback asked to stop
  // Packets and files.
  truncated = 20,            ///< fewer bytes than the header promises; where = bytes present
  bad_magic = 21,            ///< not a pmcd packet or file; where = byte
  unsupported_version = 22,  ///< written in another format version; where = that version
  unsupported_feature = 23,  ///< a kind or flag this decoder does not know; where = byte
  trailing_bytes = 24,       ///< bytes after the end; where = first of them
  checksum_mismatch = 25,    ///< CRC32C differs; where = byte of the checksum
  out_of_order = 26,         ///< not the packet that comes next; where = its level
  wrong_mesh = 27,           ///< a packet of another mesh or of another encoding of it
  limit_exceeded = 28,       ///< more vertices, faces or bytes than the decoder was allowed
  corrupt_data = 29,         ///< the content contradicts itself although its checksum is right
  hash_mismatch = 30,        ///< decoded without contradiction, but not to the mesh that was encoded; where = level
  // A bug in pmcd.
  internal_error = 99,  ///< please report it
};

/// The stable name of a code, for instance "non_manifold_edge". Never null.
const char* error_name(ErrorCode code);

struct Error {
  ErrorCode code;
  std::uint64_t where = 0;  ///< meaning depends on the code, see above
  std::string detail;       ///< one sentence in plain words, without file name
};

/// A value or an error. REQUIRES: value() only if ok(), error() only if not.
template <typename T, typename E = Error>
class [[nodiscard]] Result {
 public:
  Result(T value) : state_(std::in_place_index<0>, std::move(value)) {}  // NOLINT(google-explicit-constructor)
  Result(E error) : state_(std::in_place_index<1>, std::move(error)) {}  // NOLINT(google-explicit-constructor)

  [[nodiscard]] bool ok() const { return state_.index() == 0; }
  explicit operator bool() const { return ok(); }

  T& value() & { return *std::get_if<0>(&state_); }
  const T& value() const& { return *std::get_if<0>(&state_); }
  T value() && { return std::move(*std::get_if<0>(&state_)); }  // by value: a temporary in a range-for must not dangle
  const E& error() const { return *std::get_if<1>(&state_); }
  E& error() { return *std::get_if<1>(&state_); }

  T* operator->() { return &value(); }
  const T* operator->() const { return &value(); }
  T& operator*() & { return value(); }
  const T& operator*() const& { return value(); }

 private:
  std::variant<T, E> state_;
};

/// Success without a value, or an Error.
class [[nodiscard]] Status {
 public:
  Status() = default;
  Status(Error error) : failed_(true), error_(std::move(error)) {}  // NOLINT(google-explicit-constructor)

  [[nodiscard]] bool ok() const { return !failed_; }
  explicit operator bool() const { return ok(); }
  const Error& error() const { return error_; }

 private:
  bool failed_ = false;
  Error error_{ErrorCode::internal_error, 0, {}};
};

}  // namespace pmcd::codec
