// SPDX-License-Identifier: MIT
// The golden meshes: small generated ones that between them use every part of the format, with the options that they
// are encoded with. tests/golden/ holds what encode() made of each; make_golden remakes it.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "codec/encoder.h"
#include "codec/mesh/triangle_mesh.h"

namespace pmcd::codec::testing {

struct GoldenMesh {
  std::string name;
  TriangleMesh mesh;
  EncodeOptions options;
};

std::vector<GoldenMesh> golden_meshes();

/// FNV-1a (64 bit) of the mesh's numbers as little-endian bytes: counts, positions as doubles, faces. Not the codec's
/// hash.
std::uint64_t mesh_digest(const TriangleMesh& mesh);

/// One line for each level of the packets: name, level, vertices, faces, digest. Empty if they do not decode.
std::vector<std::string> level_lines(const std::string& name, const std::vector<std::vector<std::byte>>& packets);

}  // namespace pmcd::codec::testing
