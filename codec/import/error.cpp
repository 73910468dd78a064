// SPDX-License-Identifier: GPL-3.0-or-later
// Names of import errors and their one-line form.
#include "codec/import/error.h"

namespace pmcd::import {

const char* error_name(ImportErrorCode code) {
  switch (code) {
    case ImportErrorCode::cannot_read:
      return "cannot_read";
    case ImportErrorCode::cannot_write:
      return "cannot_write";
    case ImportErrorCode::unknown_extension:
      return "unknown_extension";
    case ImportErrorCode::empty_file:
      return "empty_file";
    case ImportErrorCode::compressed:
      return "compressed";
    case ImportErrorCode::wrong_format:
      return "wrong_format";
    case ImportErrorCode::unsupported_variant:
      return "unsupported_variant";
    case ImportErrorCode::truncated:
      return "truncated";
    case ImportErrorCode::trailing_data:
      return "trailing_data";
    case ImportErrorCode::malformed:
      return "malformed";
    case ImportErrorCode::non_finite_coordinate:
      return "non_finite_coordinate";
    case ImportErrorCode::coordinate_out_of_range:
      return "coordinate_out_of_range";
    case ImportErrorCode::index_out_of_range:
      return "index_out_of_range";
    case ImportErrorCode::too_few_corners:
      return "too_few_corners";
    case ImportErrorCode::too_large:
      return "too_large";
    case ImportErrorCode::repeated_index_in_face:
      return "repeated_index_in_face";
    case ImportErrorCode::duplicate_face:
      return "duplicate_face";
    case ImportErrorCode::non_manifold_edge:
      return "non_manifold_edge";
    case ImportErrorCode::non_manifold_vertex:
      return "non_manifold_vertex";
    case ImportErrorCode::not_orientable:
      return "not_orientable";
    case ImportErrorCode::left_out:
      return "left_out";
    case ImportErrorCode::invalid_option:
      return "invalid_option";
    case ImportErrorCode::cancelled:
      return "cancelled";
    case ImportErrorCode::encoder_refused:
      return "encoder_refused";
    case ImportErrorCode::bad_packet_file:
      return "bad_packet_file";
  }
  return "unknown";
}

std::string to_line(const ImportError& error) {
  std::string out = error.file.empty() ? "input" : error.file;
  if (error.line) {
    out.append(":").append(std::to_string(*error.line));
  } else if (error.byte) {
    out.append(": byte ").append(std::to_string(*error.byte));
  }
  return out + ": " + error.message + " [" + error_name(error.code) + "]";
}

}  // namespace pmcd::import
