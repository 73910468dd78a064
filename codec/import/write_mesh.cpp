// SPDX-License-Identifier: GPL-3.0-or-later
// The four writers. Text coordinates are the shortest that read back to the same bits.
#include "codec/import/write_mesh.h"

#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <string_view>

#include "codec/import/file_io.h"
#include "codec/import/text.h"

namespace pmcd::import {
namespace {

using codec::Face;
using codec::Position;
using codec::Scalar;
using codec::TriangleMesh;

class Out {
 public:
  explicit Out(std::size_t expected) { bytes_.reserve(expected); }

  Out& text(std::string_view s) {
    for (const char c : s) bytes_.push_back(static_cast<std::byte>(c));
    return *this;
  }
  template <typename Number>
  Out& number(Number value) {
    std::array<char, 40> buffer;
    const auto [end, problem] = std::to_chars(buffer.data(), buffer.data() + buffer.size(), value);
    return text(problem == std::errc{} ? std::string_view(buffer.data(), end) : std::string_view("0"));
  }
  Out& coordinate(double value, Scalar scalar) {
    return scalar == Scalar::float32 ? number(static_cast<float>(value)) : number(value);
  }
  template <typename Unsigned>
  Out& little_endian(Unsigned value) {
    for (std::size_t i = 0; i < sizeof(Unsigned); ++i) {
      bytes_.push_back(static_cast<std::byte>(static_cast<std::uint64_t>(value) >> 8 * i & 0xff));
    }
    return *this;
  }
  Out& float32(double value) { return little_endian(std::bit_cast<std::uint32_t>(static_cast<float>(value))); }
  Out& float64(double value) { return little_endian(std::bit_cast<std::uint64_t>(value)); }

  std::vector<std::byte> take() { return std::move(bytes_); }

 private:
  std::vector<std::byte> bytes_;
};

Written ply(const TriangleMesh& mesh) {
  const bool wide = mesh.scalar == Scalar::float64;
  Out out(400 + mesh.positions.size() * (wide ? 24 : 12) + mesh.faces.size() * 13);
  const std::string_view type = wide ? "double" : "float";
  out.text("ply\nformat binary_little_endian 1.0\ncomment written by pmcd\nelement vertex ")
      .number(mesh.positions.size());
  for (const std::string_view axis : {"x", "y", "z"}) out.text("\nproperty ").text(type).text(" ").text(axis);
  out.text("\nelement face ").number(mesh.faces.size()).text("\nproperty list uchar int vertex_indices\nend_header\n");
  for (const Position& p : mesh.positions) {
    for (const double c : p) wide ? out.float64(c) : out.float32(c);
  }
  for (const Face& face : mesh.faces) {
    out.little_endian(std::uint8_t{3});
    for (const std::uint32_t v : face) out.little_endian(v);
  }
  return {out.take(), {}};
}

void note_double(const TriangleMesh& mesh, Written& written) {
  if (mesh.scalar == Scalar::float64) {
    written.notes.emplace_back(
        "coordinates are double and the format does not say so; pmctool reads them with --double");
  }
}

Written obj(const TriangleMesh& mesh) {
  Out out(100 + mesh.positions.size() * 36 + mesh.faces.size() * 24);
  out.text("# written by pmcd\n");
  for (const Position& p : mesh.positions) {
    out.text("v");
    for (const double c : p) out.text(" ").coordinate(c, mesh.scalar);
    out.text("\n");
  }
  for (const Face& face : mesh.faces) {
    out.text("f");
    for (const std::uint32_t v : face) out.text(" ").number(std::uint64_t{v} + 1);
    out.text("\n");
  }
  Written written{out.take(), {}};
  note_double(mesh, written);
  return written;
}

Written off(const TriangleMesh& mesh) {
  Out out(100 + mesh.positions.size() * 36 + mesh.faces.size() * 24);
  out.text("OFF\n").number(mesh.positions.size()).text(" ").number(mesh.faces.size()).text(" 0\n");
  for (const Position& p : mesh.positions) {
    out.coordinate(p[0], mesh.scalar).text(" ").coordinate(p[1], mesh.scalar).text(" ").coordinate(p[2], mesh.scalar);
    out.text("\n");
  }
  for (const Face& face : mesh.faces) {
    out.text("3");
    for (const std::uint32_t v : face) out.text(" ").number(v);
    out.text("\n");
  }
  Written written{out.take(), {}};
  note_double(mesh, written);
  return written;
}

/// Unit normal, zero if the face has no area.
Position normal_of(const TriangleMesh& mesh, const Face& face) {
  const Position& a = mesh.positions[face[0]];
  const Position& b = mesh.positions[face[1]];
  const Position& c = mesh.positions[face[2]];
  Position n{};
  for (std::size_t k = 0; k < 3; ++k) {
    const std::size_t u = (k + 1) % 3;
    const std::size_t v = (k + 2) % 3;
    n[k] = (b[u] - a[u]) * (c[v] - a[v]) - (b[v] - a[v]) * (c[u] - a[u]);
  }
  const double length = std::sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
  if (!(length > 0) || !std::isfinite(length)) return {0, 0, 0};
  return {n[0] / length, n[1] / length, n[2] / length};
}

ImportResult<Written> stl(const TriangleMesh& mesh) {
  std::vector<bool> used(mesh.positions.size(), false);
  for (const Face& face : mesh.faces) {
    for (const std::uint32_t v : face) used[v] = true;
  }
  std::uint64_t isolated = 0;
  for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
    if (!used[v]) {
      ++isolated;
      continue;
    }
    for (const double c : mesh.positions[v]) {
      if (mesh.scalar == Scalar::float32 || is_float32(c)) continue;
      ImportError error;
      error.code = ImportErrorCode::cannot_write;
      error.element = v;
      error.message = "STL holds 32-bit floats, but vertex " + std::to_string(v) +
                      " (counted from 0) has a coordinate that is none; write PLY instead";
      return error;
    }
  }
  Out out(84 + mesh.faces.size() * 50);
  std::string header = "binary STL written by pmcd";
  header.resize(80, ' ');
  out.text(header).little_endian(static_cast<std::uint32_t>(mesh.faces.size()));
  for (const Face& face : mesh.faces) {
    for (const double c : normal_of(mesh, face)) out.float32(c);
    for (const std::uint32_t v : face) {
      for (const double c : mesh.positions[v]) out.float32(c);
    }
    out.little_endian(std::uint16_t{0});
  }
  Written written{out.take(), {}};
  written.notes.emplace_back("STL keeps no vertex numbers; a reader joins all corners at the same place");
  if (isolated > 0) {
    written.notes.emplace_back("STL holds faces only; isolated vertices not written: " + std::to_string(isolated));
  }
  return written;
}

}  // namespace

ImportResult<Written> format_mesh(const TriangleMesh& mesh, const std::string& extension) {
  if (extension == "ply") return ply(mesh);
  if (extension == "obj") return obj(mesh);
  if (extension == "off") return off(mesh);
  if (extension == "stl") return stl(mesh);
  ImportError error;
  error.code = ImportErrorCode::unknown_extension;
  error.message = "the extension " + shown(extension) + " names no mesh format; pmcd writes .ply, .obj, .off and .stl";
  return error;
}

ImportResult<std::vector<std::string>> write_mesh(const std::string& path, const TriangleMesh& mesh) {
  ImportResult<Written> written = format_mesh(mesh, extension_of(path));
  if (!written) {
    written.error().file = path;
    return written.error();
  }
  if (ImportFailure failure = save_file(path, written->bytes)) return std::move(*failure);
  return std::move(written->notes);
}

}  // namespace pmcd::import
