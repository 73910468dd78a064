// SPDX-License-Identifier: GPL-3.0-or-later
// What the import tests share: bytes of small files, meshes made by formula, renumbering. It asserts nothing itself.
#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <numeric>
#include <optional>
#include <random>
#include <string>
#include <string_view>
#include <vector>

#include "codec/import/error.h"
#include "codec/import/read_mesh.h"
#include "codec/mesh/triangle_mesh.h"

namespace pmcd::import::testing {

using codec::Face;
using codec::Position;
using codec::Scalar;
using codec::TriangleMesh;

inline std::vector<std::byte> bytes_of(std::string_view text) {
  std::vector<std::byte> out(text.size());
  std::transform(text.begin(), text.end(), out.begin(), [](char c) { return static_cast<std::byte>(c); });
  return out;
}

inline ImportResult<ImportedMesh> read_text(std::string_view text, const std::string& extension,
                                            const ImportOptions& options = {}) {
  return read_mesh(bytes_of(text), extension, options);
}

/// Builds a binary file piece by piece.
class Binary {
 public:
  explicit Binary(std::string_view header, bool big_endian = false) : bytes_(bytes_of(header)), big_(big_endian) {}
  template <typename Number>
  Binary& put(Number value) {
    std::array<std::byte, sizeof(Number)> raw = std::bit_cast<std::array<std::byte, sizeof(Number)>>(value);
    if (big_ == (std::endian::native == std::endian::little)) std::reverse(raw.begin(), raw.end());
    bytes_.insert(bytes_.end(), raw.begin(), raw.end());
    return *this;
  }
  [[nodiscard]] const std::vector<std::byte>& bytes() const { return bytes_; }

 private:
  std::vector<std::byte> bytes_;
  bool big_;
};

/// A folder of its own that goes away with the object.
class TemporaryFolder {
 public:
  TemporaryFolder() {
    std::string name = (std::filesystem::temp_directory_path() / "pmcd-test-XXXXXX").string();
    path_ = ::mkdtemp(name.data()) ? name : std::string();
  }
  ~TemporaryFolder() {
    std::error_code ignored;
    if (!path_.empty()) std::filesystem::remove_all(path_, ignored);
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  [[nodiscard]] std::string file(const std::string& name) const { return path_ + "/" + name; }
  [[nodiscard]] std::size_t entries() const {
    return static_cast<std::size_t>(std::distance(std::filesystem::directory_iterator(path_), {}));
  }

 private:
  std::string path_;
};

inline double as_float(double x) {
  return static_cast<double>(static_cast<float>(x));
}

/// A closed torus of 2 * rings * sides faces, float32.
inline TriangleMesh torus(std::uint32_t rings, std::uint32_t sides) {
  TriangleMesh mesh;
  constexpr double kTurn = 6.283185307179586;
  for (std::uint32_t r = 0; r < rings; ++r) {
    for (std::uint32_t s = 0; s < sides; ++s) {
      const double u = kTurn * r / rings;
      const double v = kTurn * s / sides;
      mesh.positions.push_back({as_float((3 + std::cos(v)) * std::cos(u)), as_float((3 + std::cos(v)) * std::sin(u)),
                                as_float(std::sin(v))});
      const std::uint32_t a = r * sides + s;
      const std::uint32_t b = (r + 1) % rings * sides + s;
      const std::uint32_t c = (r + 1) % rings * sides + (s + 1) % sides;
      const std::uint32_t d = r * sides + (s + 1) % sides;
      mesh.faces.push_back({a, b, c});
      mesh.faces.push_back({a, c, d});
    }
  }
  return mesh;
}

inline TriangleMesh tetrahedron() {
  TriangleMesh mesh;
  mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  mesh.faces = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 2}};
  return mesh;
}

/// The same mesh in other numbers: vertices and faces shuffled, corners of each face rotated.
inline TriangleMesh renumbered(const TriangleMesh& mesh, unsigned seed) {
  std::mt19937 random(seed);
  std::vector<std::uint32_t> name(mesh.positions.size());
  std::iota(name.begin(), name.end(), 0u);
  std::shuffle(name.begin(), name.end(), random);
  TriangleMesh out;
  out.scalar = mesh.scalar;
  out.positions.resize(mesh.positions.size());
  for (std::size_t v = 0; v < name.size(); ++v) out.positions[name[v]] = mesh.positions[v];
  for (const Face& f : mesh.faces) {
    const Face g{name[f[0]], name[f[1]], name[f[2]]};
    const std::size_t turn = random() % 3;
    out.faces.push_back({g[turn], g[(turn + 1) % 3], g[(turn + 2) % 3]});
  }
  std::shuffle(out.faces.begin(), out.faces.end(), random);
  return out;
}

/// Both meshes side by side in one.
inline TriangleMesh joined(const TriangleMesh& a, const TriangleMesh& b) {
  TriangleMesh out = a;
  const auto shift = static_cast<std::uint32_t>(a.positions.size());
  out.positions.insert(out.positions.end(), b.positions.begin(), b.positions.end());
  for (const Face& f : b.faces) out.faces.push_back({f[0] + shift, f[1] + shift, f[2] + shift});
  return out;
}

/// The folder of PMCD_TEST_MESHES; none if the variable is unset or empty.
inline std::optional<std::string> mesh_folder() {
  const char* const folder = std::getenv("PMCD_TEST_MESHES");
  if (folder == nullptr || *folder == '\0') return std::nullopt;
  return std::string(folder);
}

}  // namespace pmcd::import::testing
