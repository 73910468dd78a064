// SPDX-License-Identifier: GPL-3.0-or-later
// The way out: a mesh as PLY (binary little endian), OBJ, OFF or STL (binary), chosen by the extension. Reading what
// was written gives the same bits, within what the format can hold; what it cannot is told or refused.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "codec/import/error.h"
#include "codec/mesh/triangle_mesh.h"

namespace pmcd::import {

struct Written {
  std::vector<std::byte> bytes;
  std::vector<std::string> notes;  ///< what a reader of this format will not get back, a line each
};

/// The file's bytes. REQUIRES: every index < positions.size(); a float32 mesh holds float32 values only.
/// Errors: unknown_extension; cannot_write if the format cannot hold the mesh (STL and coordinates that are not
/// float32).
ImportResult<Written> format_mesh(const codec::TriangleMesh& mesh, const std::string& extension);

/// Writes `path`, wholly or not at all; answers the notes. Errors: also cannot_write from the operating system.
ImportResult<std::vector<std::string>> write_mesh(const std::string& path, const codec::TriangleMesh& mesh);

}  // namespace pmcd::import
