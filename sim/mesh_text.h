// SPDX-License-Identifier: MIT
// The two written forms of meshes: documents of pmcctl, and a table. They know no files.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "sim/meshes.h"
#include "sim/place.h"

namespace pmcd::sim {

/// Meshes as pmcctl shows or lists them, in an array that stands at `place`. Fields that it does not know are left
/// alone. REQUIRES: `rows` is an array.
Result<std::vector<Mesh>> meshes_of(const nlohmann::json& rows, const Place& place);
/// JSON as parse_meshes() takes it.
Result<std::vector<Mesh>> parse_mesh_documents(std::string_view text, const std::string& from);
/// The table as parse_meshes() takes it: rows of a mesh follow each other, levels count from 0.
Result<std::vector<Mesh>> parse_mesh_table(std::string_view text, const std::string& from);

}  // namespace pmcd::sim
