// SPDX-License-Identifier: GPL-3.0-or-later
// The way in: a mesh file becomes an oriented manifold triangle mesh that the encoder takes, or an error that says what
// is wrong with it and where. PLY, OBJ, OFF and STL, chosen by the extension. Nothing is repaired in silence.
#pragma once

#include <cstddef>
#include <span>
#include <string>

#include "codec/import/error.h"
#include "codec/import/raw_mesh.h"
#include "codec/import/report.h"
#include "codec/mesh/triangle_mesh.h"

namespace pmcd::import {

struct ImportOptions {
  bool strict = false;     ///< data that would be left out is an error
  bool as_double = false;  ///< text coordinates become the nearest double instead of the nearest float32
};

struct ImportedMesh {
  codec::TriangleMesh mesh;
  ImportReport report;
};

/// Reads `path`. Polygons are triangulated, STL corners of equal bits welded, faces turned to agree; the report counts
/// each. Refused by name: faces with a repeated index, duplicate faces, edges with more than two faces, vertices with
/// more than one fan, meshes that are not orientable. Isolated vertices and faces of zero area are kept.
/// Memory: the file and about 150 bytes a vertex. Time: linear, apart from sorting.
ImportResult<ImportedMesh> read_mesh(const std::string& path, const ImportOptions& options = {});

/// The same for a file in memory; `extension` in lower case without dot. Errors carry no file name.
ImportResult<ImportedMesh> read_mesh(std::span<const std::byte> bytes, const std::string& extension,
                                     const ImportOptions& options = {});

/// What comes behind the readers: repairs and refusals. `bytes` is the file that `raw` was read from.
ImportResult<ImportedMesh> prepare(RawMesh raw, std::span<const std::byte> bytes, const ImportOptions& options = {});

}  // namespace pmcd::import
