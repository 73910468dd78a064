// SPDX-License-Identifier: GPL-3.0-or-later
// Geomview OFF as text, with the prefixes ST, C and N: one vertex or face a line; colours, normals and texture
// coordinates are left out. Not read: other dimensions (4OFF, nOFF) and binary OFF, each refused by name.
#include <algorithm>
#include <limits>

#include "codec/import/raw_mesh.h"

namespace pmcd::import {
namespace {

class OffReader {
 public:
  OffReader(std::span<const std::byte> bytes, const ReadOptions& options)
      : bytes_(bytes), lines_(as_text(bytes), 0, {.hash_comments = true, .backslash_continues = false}) {
    mesh_.scalar = options.as_double ? codec::Scalar::float64 : codec::Scalar::float32;
  }

  ImportResult<RawMesh> read() {
    if (ImportFailure failure = read_header()) return std::move(*failure);
    // A vertex takes at least 6 bytes ("0 0 0\n"), a face 8; reserving by the claim alone would let a header allocate.
    mesh_.positions.reserve(std::min<std::uint64_t>(vertices_, bytes_.size() / 6 + 1));
    for (std::uint64_t v = 0; v < vertices_; ++v) {
      if (ImportFailure failure = read_vertex(v)) return std::move(*failure);
    }
    mesh_.polygon_end.reserve(std::min<std::uint64_t>(faces_, bytes_.size() / 8 + 1));
    for (std::uint64_t f = 0; f < faces_; ++f) {
      if (ImportFailure failure = read_face(f)) return std::move(*failure);
    }
    if (lines_.next()) {
      return here(ImportErrorCode::trailing_data, "the header promises " + std::to_string(faces_) +
                                                      " faces, but another line follows; correct the counts");
    }
    list_left_out();
    return std::move(mesh_);
  }

 private:
  [[nodiscard]] ImportError here(ImportErrorCode code, std::string message) const {
    return error_at(code, bytes_, lines_.place(), true, std::move(message));
  }

  [[nodiscard]] ImportError not_off() const {
    return here(ImportErrorCode::wrong_format, "an OFF file starts with OFF, COFF, NOFF or STOFF; this one does not");
  }

  ImportFailure read_header() {
    if (!lines_.next()) return not_off();
    Tokens tokens(lines_.line());
    if (ImportFailure failure = read_keyword(tokens.next())) return failure;
    std::string_view token = tokens.next();
    if (token == "BINARY") {
      return here(ImportErrorCode::unsupported_variant, "binary OFF is not read; convert it to text OFF or PLY");
    }
    if (token.empty()) {
      if (!lines_.next()) {
        return here(ImportErrorCode::truncated, "the file ends before its counts; fetch or export it again");
      }
      tokens = Tokens(lines_.line());
      token = tokens.next();
    }
    // The third count, of edges, means nothing and some writers leave it out.
    for (std::uint64_t* count : {&vertices_, &faces_}) {
      const std::optional<std::int64_t> parsed = parse_integer(token);
      if (!parsed || *parsed < 0) {
        return here(ImportErrorCode::malformed,
                    "here should stand the counts of vertices, faces and edges, but there is " + shown(token));
      }
      *count = static_cast<std::uint64_t>(*parsed);
      token = tokens.next();
    }
    return {};
  }

  /// [ST][C][N][4][n]OFF
  ImportFailure read_keyword(std::string_view keyword) {
    std::string_view rest = keyword;
    const auto take = [&](std::string_view prefix) {
      if (!rest.starts_with(prefix)) return false;
      rest.remove_prefix(prefix.size());
      return true;
    };
    texture_ = take("ST");
    colour_ = take("C");
    normal_ = take("N");
    const bool four = take("4");
    const bool any = take("n");
    if (rest != "OFF") return not_off();
    if (four || any) {
      return here(ImportErrorCode::unsupported_variant, shown(keyword) +
                                                            " has vertices that are not three-dimensional, which pmcd "
                                                            "does not read; export the mesh as OFF or PLY");
    }
    mesh_.format = keyword;
    return {};
  }

  ImportFailure read_vertex(std::uint64_t v) {
    if (!lines_.next()) return cut_short("vertices", v, vertices_);
    Tokens tokens(lines_.line());
    codec::Position position{};
    for (double& coordinate : position) {
      const std::string_view token = tokens.next();
      const NumberProblem problem = parse_coordinate(token, mesh_.scalar, coordinate);
      if (problem != NumberProblem::none) {
        return coordinate_error(problem, token, mesh_.scalar, bytes_, lines_.place(), v);
      }
    }
    if (!tokens.next().empty()) ++vertices_with_more_;
    if (!add_vertex(mesh_, position, lines_.place())) return too_large_error(bytes_, lines_.place(), true);
    return {};
  }

  ImportFailure read_face(std::uint64_t f) {
    if (!lines_.next()) return cut_short("faces", f, faces_);
    Tokens tokens(lines_.line());
    const std::string_view first = tokens.next();
    const std::optional<std::int64_t> count = parse_integer(first);
    if (!count || *count < 0) {
      return face_error(ImportErrorCode::malformed, f,
                        "starts with " + shown(first) + " instead of its number of corners; correct the line");
    }
    if (*count < 3) {
      return face_error(ImportErrorCode::too_few_corners, f,
                        std::to_string(*count) + " corners; a face needs three or more, remove it or complete it");
    }
    for (std::int64_t c = 0; c < *count; ++c) {
      const std::string_view token = tokens.next();
      if (token.empty()) {
        return face_error(ImportErrorCode::malformed, f,
                          "promises " + std::to_string(*count) + " corners and has " + std::to_string(c));
      }
      const std::optional<std::int64_t> index = parse_integer(token);
      if (!index) return face_error(ImportErrorCode::malformed, f, "corner " + shown(token) + " is not a number");
      if (*index < 0 || static_cast<std::uint64_t>(*index) >= vertices_) {
        return face_error(
            ImportErrorCode::index_out_of_range, f,
            "corner " + shown(token) + " names no vertex; there are " + std::to_string(vertices_) + ", counted from 0");
      }
      mesh_.corners.push_back(static_cast<std::uint32_t>(*index));
    }
    if (!tokens.next().empty()) ++faces_with_more_;
    if (!end_polygon(mesh_, lines_.place())) return too_large_error(bytes_, lines_.place(), true);
    return {};
  }

  [[nodiscard]] ImportError cut_short(const char* what, std::uint64_t have, std::uint64_t promised) const {
    ImportError error = here(ImportErrorCode::truncated, "the header promises " + std::to_string(promised) + " " +
                                                             what + ", the file ends after " + std::to_string(have) +
                                                             "; it is cut short or its counts are wrong");
    error.element = have;
    return error;
  }

  [[nodiscard]] ImportError face_error(ImportErrorCode code, std::uint64_t face, const std::string& message) const {
    ImportError error = here(code, "face " + std::to_string(face) + " (counted from 0): " + message);
    error.element = face;
    return error;
  }

  void list_left_out() {
    if (vertices_with_more_ > 0) {
      std::string names;
      const auto add = [&](bool there, const char* name) {
        if (there) names += (names.empty() ? "" : ", ") + std::string(name);
      };
      add(normal_, "normals");
      add(colour_, "colours");
      add(texture_, "texture coordinates");
      if (names.empty()) names = "values behind the coordinates";
      mesh_.left_out.push_back(names + " of " + std::to_string(vertices_with_more_) + " vertices");
    }
    if (faces_with_more_ > 0) mesh_.left_out.push_back("colours of " + std::to_string(faces_with_more_) + " faces");
  }

  std::span<const std::byte> bytes_;
  Lines lines_;
  RawMesh mesh_;
  std::uint64_t vertices_ = 0;
  std::uint64_t faces_ = 0;
  bool texture_ = false;
  bool colour_ = false;
  bool normal_ = false;
  std::uint64_t vertices_with_more_ = 0;
  std::uint64_t faces_with_more_ = 0;
};

}  // namespace

ImportResult<RawMesh> read_off(std::span<const std::byte> bytes, const ReadOptions& options) {
  return OffReader(bytes, options).read();
}

}  // namespace pmcd::import
