// SPDX-License-Identifier: GPL-3.0-or-later
// What the offline commands share: how errors reach the user, numbers in words, tables, and meshes out of any file.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "codec/import/error.h"
#include "codec/import/read_mesh.h"
#include "codec/mesh/triangle_mesh.h"

namespace pmcd::tool {

/// Writes "pmctool COMMAND: FILE:LINE: ..." to stderr; answers the exit code that belongs to the error.
int complain(const char* command, const import::ImportError& error);

/// printf-style with `digits` behind the point.
std::string fixed(double value, int digits);
/// A relative error for people, "-" if it was not measured.
std::string error_figure(double error);
/// 64 bits as 16 hexadecimal digits.
std::string hex(std::uint64_t value);

/// Rows of equal length on stdout, columns as wide as their widest cell; numbers to the right, a first column of names
/// to the left.
enum class FirstColumn : std::uint8_t { numbers, names };
void print_table(const std::vector<std::vector<std::string>>& rows, FirstColumn first, const std::string& indent);

/// True if the file is a .pmcd file, by its extension or by its first bytes.
bool is_packet_file(const std::string& path);

/// The mesh of a mesh file, or the last level of a .pmcd file (its report then names the format and the counts only).
import::ImportResult<import::ImportedMesh> load_mesh(const std::string& path, const import::ImportOptions& options);

}  // namespace pmcd::tool
