// SPDX-License-Identifier: GPL-3.0-or-later
// Wavefront OBJ: v and f; everything else is listed as left out. Free-form surfaces are not evaluated.
#include <algorithm>
#include <limits>

#include "codec/import/raw_mesh.h"

namespace pmcd::import {
namespace {

struct Statement {
  std::string keyword;
  std::uint64_t count = 0;
};

/// What a keyword that is not read stands for; null if only its own name is known.
const char* meaning(std::string_view keyword) {
  if (keyword == "vt") return "texture coordinates";
  if (keyword == "vn") return "normals";
  if (keyword == "vp") return "parameter-space vertices";
  if (keyword == "usemtl") return "uses of materials";
  if (keyword == "mtllib") return "material libraries";
  if (keyword == "g") return "groups";
  if (keyword == "o") return "object names";
  if (keyword == "s") return "smoothing groups";
  if (keyword == "l") return "line elements";
  if (keyword == "p") return "point elements";
  return nullptr;
}

bool looks_like_keyword(std::string_view token) {
  constexpr std::size_t kLongestKeyword = 32;
  const auto letter = [](char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_'; };
  const auto letter_or_digit = [&](char c) { return letter(c) || (c >= '0' && c <= '9'); };
  return token.size() <= kLongestKeyword && letter(token.front()) &&
         std::all_of(token.begin(), token.end(), letter_or_digit);
}

class ObjReader {
 public:
  ObjReader(std::span<const std::byte> bytes, const ReadOptions& options)
      : bytes_(bytes), lines_(as_text(bytes), 0, {.hash_comments = true, .backslash_continues = true}) {
    mesh_.format = "OBJ";
    mesh_.scalar = options.as_double ? codec::Scalar::float64 : codec::Scalar::float32;
  }

  ImportResult<RawMesh> read() {
    while (lines_.next()) {
      Tokens tokens(lines_.line());
      const std::string_view keyword = tokens.next();
      ImportFailure failure;
      if (keyword == "v") {
        failure = read_vertex(tokens);
      } else if (keyword == "f" || keyword == "fo") {
        failure = read_face(tokens);
      } else if (looks_like_keyword(keyword)) {
        leave_out(keyword);
      } else {
        failure = here(ImportErrorCode::malformed,
                       "a line cannot start with " + shown(keyword) + "; this is not an OBJ file, or it is damaged");
      }
      if (failure) return std::move(*failure);
    }
    if (mesh_.positions.empty()) {
      return here(ImportErrorCode::wrong_format, "no line starts with 'v'; this is not an OBJ file, or it has no mesh");
    }
    list_left_out();
    return std::move(mesh_);
  }

 private:
  [[nodiscard]] ImportError here(ImportErrorCode code, std::string message) const {
    return error_at(code, bytes_, lines_.place(), true, std::move(message));
  }

  ImportFailure read_vertex(Tokens& tokens) {
    codec::Position position{};
    for (double& coordinate : position) {
      const std::string_view token = tokens.next();
      const NumberProblem problem = parse_coordinate(token, mesh_.scalar, coordinate);
      if (problem != NumberProblem::none) {
        return coordinate_error(problem, token, mesh_.scalar, bytes_, lines_.place(), mesh_.positions.size());
      }
    }
    if (!tokens.next().empty()) ++vertices_with_more_;
    if (!add_vertex(mesh_, position, lines_.place())) return too_large_error(bytes_, lines_.place(), true);
    return {};
  }

  ImportFailure read_face(Tokens& tokens) {
    const std::size_t start = mesh_.corners.size();
    for (std::string_view token = tokens.next(); !token.empty(); token = tokens.next()) {
      const std::optional<std::int64_t> index = corner(token);
      if (!index) {
        return face_error(ImportErrorCode::malformed,
                          shown(token) + " is not a corner such as 7, 7/1, 7//2 or 7/1/2; correct the line");
      }
      const auto defined = static_cast<std::int64_t>(mesh_.positions.size());
      const std::int64_t vertex = *index > 0 ? *index - 1 : defined + *index;
      // A positive index may name a vertex that comes later in the file; prepare() checks it against the whole.
      if (*index == 0 || vertex < 0 || vertex >= std::numeric_limits<std::uint32_t>::max()) {
        return face_error(ImportErrorCode::index_out_of_range,
                          "corner " + shown(token) + " names no vertex (they count from 1, or from -1 backwards)");
      }
      mesh_.corners.push_back(static_cast<std::uint32_t>(vertex));
    }
    const std::size_t count = mesh_.corners.size() - start;
    if (count < 3) {
      return face_error(ImportErrorCode::too_few_corners,
                        std::to_string(count) + " corners; a face needs three or more, remove it or complete it");
    }
    if (!end_polygon(mesh_, lines_.place())) return too_large_error(bytes_, lines_.place(), true);
    return {};
  }

  [[nodiscard]] ImportError face_error(ImportErrorCode code, const std::string& message) const {
    const std::uint64_t face = mesh_.polygon_end.size();
    ImportError error = here(code, "face " + std::to_string(face) + " (counted from 0): " + message);
    error.element = face;
    return error;
  }

  /// The vertex index of v, v/vt, v//vn or v/vt/vn as it stands; none if the token is anything else.
  static std::optional<std::int64_t> corner(std::string_view token) {
    const std::size_t slash = token.find('/');
    if (slash != std::string_view::npos) {
      std::string_view rest = token.substr(slash + 1);
      const std::size_t second = rest.find('/');
      const std::string_view texture = rest.substr(0, second);
      if (!texture.empty() && !parse_integer(texture)) return std::nullopt;
      if (second != std::string_view::npos) {
        const std::string_view normal = rest.substr(second + 1);
        if (!normal.empty() && !parse_integer(normal)) return std::nullopt;
      }
    }
    return parse_integer(token.substr(0, slash));
  }

  void leave_out(std::string_view keyword) {
    const auto known =
        std::find_if(statements_.begin(), statements_.end(), [&](const Statement& s) { return s.keyword == keyword; });
    if (known != statements_.end()) {
      ++known->count;
    } else if (statements_.size() < kMostKeywords) {
      statements_.push_back({std::string(keyword), 1});
    } else {
      ++others_;
    }
  }

  void list_left_out() {
    if (vertices_with_more_ > 0) {
      mesh_.left_out.push_back("weights or colours behind the coordinates of " + std::to_string(vertices_with_more_) +
                               " vertices");
    }
    for (const Statement& s : statements_) {
      const char* const words = meaning(s.keyword);
      mesh_.left_out.push_back(
          (words ? std::string(words) + " (" + s.keyword + ")" : "statements '" + s.keyword + "'") + ", " +
          std::to_string(s.count) + (s.count == 1 ? " line" : " lines"));
    }
    if (others_ > 0) mesh_.left_out.push_back("other statements, " + std::to_string(others_) + " lines");
  }

  static constexpr std::size_t kMostKeywords = 64;  // keeps the list short and the look-up cheap on garbage

  std::span<const std::byte> bytes_;
  Lines lines_;
  RawMesh mesh_;
  std::vector<Statement> statements_;
  std::uint64_t others_ = 0;
  std::uint64_t vertices_with_more_ = 0;
};

}  // namespace

ImportResult<RawMesh> read_obj(std::span<const std::byte> bytes, const ReadOptions& options) {
  return ObjReader(bytes, options).read();
}

}  // namespace pmcd::import
