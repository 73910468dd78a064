// SPDX-License-Identifier: GPL-3.0-or-later
// STL, ascii and binary. The size decides first (84 + 50 a triangle), since binary files may start with "solid" too.
// Each triangle brings its own three vertices; prepare() welds them. Normals and attribute bytes are left out.
#include <array>
#include <bit>
#include <cmath>
#include <cstring>

#include "codec/import/raw_mesh.h"

namespace pmcd::import {
namespace {

constexpr std::size_t kHeaderBytes = 80;
constexpr std::size_t kFirstTriangle = kHeaderBytes + 4;
constexpr std::size_t kTriangleBytes = 50;

std::uint32_t load_u32(const std::byte* from) {
  std::uint32_t value = 0;
  for (int i = 3; i >= 0; --i) value = value << 8 | std::to_integer<std::uint32_t>(from[i]);
  return value;
}

ImportResult<RawMesh> read_binary(std::span<const std::byte> bytes, std::uint32_t triangles,
                                  const ReadOptions& options) {
  RawMesh mesh;
  mesh.format = "STL, binary";
  mesh.text = false;
  mesh.corners_stand_alone = true;
  mesh.scalar = options.as_double ? codec::Scalar::float64 : codec::Scalar::float32;
  bool normals = false;
  bool attributes = false;
  for (std::uint32_t t = 0; t < triangles; ++t) {
    const std::size_t place = kFirstTriangle + std::size_t{t} * kTriangleBytes;
    const auto number = [&](std::size_t i) {
      return static_cast<double>(std::bit_cast<float>(load_u32(bytes.data() + place + 4 * i)));
    };
    for (std::size_t i = 0; i < 3; ++i) normals = normals || number(i) != 0;
    attributes = attributes || bytes[place + 48] != std::byte{0} || bytes[place + 49] != std::byte{0};
    for (std::size_t corner = 0; corner < 3; ++corner) {
      const std::size_t first = 3 + 3 * corner;
      const codec::Position position{number(first), number(first + 1), number(first + 2)};
      const std::size_t vertex_place = place + 4 * first;
      if (!std::isfinite(position[0]) || !std::isfinite(position[1]) || !std::isfinite(position[2])) {
        ImportError error =
            error_at(ImportErrorCode::non_finite_coordinate, bytes, vertex_place, false,
                     "triangle " + std::to_string(t) + " (counted from 0): corner " + std::to_string(corner) +
                         " has a coordinate that is not finite; correct or remove the triangle");
        error.element = t;
        return error;
      }
      mesh.corners.push_back(static_cast<std::uint32_t>(mesh.positions.size()));
      if (!add_vertex(mesh, position, vertex_place)) return too_large_error(bytes, place, false);
    }
    if (!end_polygon(mesh, place)) return too_large_error(bytes, place, false);
  }
  if (normals) mesh.left_out.emplace_back("normals of the faces");
  if (attributes) mesh.left_out.emplace_back("attribute bytes of the faces");
  return mesh;
}

class AsciiStlReader {
 public:
  AsciiStlReader(std::span<const std::byte> bytes, const ReadOptions& options)
      : bytes_(bytes), lines_(as_text(bytes), 0, {}), line_({}) {
    mesh_.format = "STL, ascii";
    mesh_.corners_stand_alone = true;
    mesh_.scalar = options.as_double ? codec::Scalar::float64 : codec::Scalar::float32;
  }

  ImportResult<RawMesh> read() {
    bool in_solid = false;
    bool any_solid = false;
    while (next_token()) {
      if (!in_solid && is("solid")) {
        in_solid = any_solid = true;
        skip_line();  // the name
      } else if (in_solid && is("endsolid")) {
        in_solid = false;
        skip_line();
      } else if (in_solid && is("facet")) {
        if (ImportFailure failure = read_facet()) return std::move(*failure);
      } else if (in_solid) {
        return expected("'facet' or 'endsolid'");
      } else if (any_solid) {
        return here(ImportErrorCode::trailing_data, "behind 'endsolid' stands " + shown(token_) + "; remove it");
      } else {
        return expected("'solid'");
      }
    }
    if (in_solid) return expected("'endsolid'");
    if (normals_) mesh_.left_out.emplace_back("normals of the faces");
    return std::move(mesh_);
  }

 private:
  bool next_token() {
    token_ = line_.next();
    while (token_.empty()) {
      if (!lines_.next()) return false;
      line_ = Tokens(lines_.line());
      token_ = line_.next();
    }
    return true;
  }
  void skip_line() { line_ = Tokens({}); }
  [[nodiscard]] bool is(std::string_view word) const { return equal_ignoring_case(token_, word); }

  [[nodiscard]] ImportError here(ImportErrorCode code, std::string message) const {
    return error_at(code, bytes_, lines_.place(), true, std::move(message));
  }

  [[nodiscard]] ImportError expected(const std::string& what) const {
    ImportError error = token_.empty()
                            ? here(ImportErrorCode::truncated,
                                   "the file ends where " + what + " should stand; fetch or export it again")
                            : here(ImportErrorCode::malformed, "here should stand " + what + ", but there is " +
                                                                   shown(token_) + "; correct the line");
    error.element = mesh_.polygon_end.size();
    return error;
  }

  ImportFailure word(std::string_view wanted) {
    if (next_token() && is(wanted)) return {};
    return expected(shown(wanted));
  }

  ImportFailure read_facet() {
    const std::uint64_t place = lines_.place();
    if (ImportFailure failure = word("normal")) return failure;
    for (int i = 0; i < 3; ++i) {
      if (!next_token()) return expected("a normal of three numbers");
      // Writers put NaN here for faces without area; the normal is left out, so any number or none will do.
      double component = 0;
      if (parse_coordinate(token_, codec::Scalar::float64, component) == NumberProblem::malformed) {
        return expected("a normal of three numbers");
      }
      normals_ = normals_ || component != 0;
    }
    for (const char* wanted : {"outer", "loop"}) {
      if (ImportFailure failure = word(wanted)) return failure;
    }
    for (int corner = 0; corner < 3; ++corner) {
      if (ImportFailure failure = read_vertex()) return failure;
    }
    for (const char* wanted : {"endloop", "endfacet"}) {
      if (ImportFailure failure = word(wanted)) return failure;
    }
    if (!end_polygon(mesh_, place)) return too_large_error(bytes_, place, true);
    return {};
  }

  ImportFailure read_vertex() {
    if (ImportFailure failure = word("vertex")) return failure;
    const std::uint64_t place = lines_.place();
    codec::Position position{};
    for (double& coordinate : position) {
      if (!next_token()) return expected("a coordinate");
      const NumberProblem problem = parse_coordinate(token_, mesh_.scalar, coordinate);
      if (problem != NumberProblem::none) {
        return coordinate_error(problem, token_, mesh_.scalar, bytes_, lines_.place(), mesh_.positions.size());
      }
    }
    mesh_.corners.push_back(static_cast<std::uint32_t>(mesh_.positions.size()));
    if (!add_vertex(mesh_, position, place)) return too_large_error(bytes_, place, true);
    return {};
  }

  std::span<const std::byte> bytes_;
  Lines lines_;
  Tokens line_;
  std::string_view token_;
  RawMesh mesh_;
  bool normals_ = false;
};

bool starts_with_solid(std::string_view text) {
  const std::size_t first = text.find_first_not_of(" \t\r\n");
  return first != std::string_view::npos && equal_ignoring_case(text.substr(first, 5), "solid");
}

}  // namespace

ImportResult<RawMesh> read_stl(std::span<const std::byte> bytes, const ReadOptions& options) {
  const bool has_count = bytes.size() >= kFirstTriangle;
  const std::uint32_t triangles = has_count ? load_u32(bytes.data() + kHeaderBytes) : 0;
  const std::uint64_t promised = kFirstTriangle + std::uint64_t{triangles} * kTriangleBytes;
  if (has_count && bytes.size() == promised) return read_binary(bytes, triangles, options);

  const std::string_view text = as_text(bytes);
  // A zero byte in the header tells a binary file of the wrong size from a text.
  if (starts_with_solid(text) && text.substr(0, kFirstTriangle).find('\0') == std::string_view::npos) {
    return AsciiStlReader(bytes, options).read();
  }
  if (!has_count) {
    return error_at(ImportErrorCode::wrong_format, bytes, bytes.size(), false,
                    "neither a binary STL file (at least 84 bytes) nor a text that starts with 'solid'");
  }
  const std::string counts = "the header promises " + std::to_string(triangles) + " triangles, which are " +
                             std::to_string(promised) + " bytes, the file has " + std::to_string(bytes.size());
  if (bytes.size() < promised) {
    return error_at(ImportErrorCode::truncated, bytes, bytes.size(), false,
                    counts + "; it is cut short or no STL file, fetch or export it again");
  }
  return error_at(ImportErrorCode::trailing_data, bytes, promised, false, counts + "; cut off what follows");
}

}  // namespace pmcd::import
