// SPDX-License-Identifier: MIT
#include "codec/result.h"

namespace pmcd::codec {

const char* error_name(ErrorCode code) {
  switch (code) {
    case ErrorCode::index_out_of_range:
      return "index_out_of_range";
    case ErrorCode::non_finite_coordinate:
      return "non_finite_coordinate";
    case ErrorCode::repeated_index_in_face:
      return "repeated_index_in_face";
    case ErrorCode::duplicate_face:
      return "duplicate_face";
    case ErrorCode::non_manifold_edge:
      return "non_manifold_edge";
    case ErrorCode::non_manifold_vertex:
      return "non_manifold_vertex";
    case ErrorCode::opposing_faces:
      return "opposing_faces";
    case ErrorCode::mesh_too_large:
      return "mesh_too_large";
    case ErrorCode::extent_too_large:
      return "extent_too_large";
    case ErrorCode::not_representable:
      return "not_representable";
    case ErrorCode::invalid_option:
      return "invalid_option";
    case ErrorCode::cancelled:
      return "cancelled";
    case ErrorCode::truncated:
      return "truncated";
    case ErrorCode::bad_magic:
      return "bad_magic";
    case ErrorCode::unsupported_version:
      return "unsupported_version";
    case ErrorCode::unsupported_feature:
      return "unsupported_feature";
    case ErrorCode::trailing_bytes:
      return "trailing_bytes";
    case ErrorCode::checksum_mismatch:
      return "checksum_mismatch";
    case ErrorCode::out_of_order:
      return "out_of_order";
    case ErrorCode::wrong_mesh:
      return "wrong_mesh";
    case ErrorCode::limit_exceeded:
      return "limit_exceeded";
    case ErrorCode::corrupt_data:
      return "corrupt_data";
    case ErrorCode::hash_mismatch:
      return "hash_mismatch";
    case ErrorCode::internal_error:
      return "internal_error";
  }
  return "unknown_error";
}

}  // namespace pmcd::codec
