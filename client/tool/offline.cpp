// SPDX-License-Identifier: GPL-3.0-or-later
// Errors, figures and files for the offline commands.
#include "client/tool/offline.h"

#include <algorithm>
#include <cstdio>
#include <fstream>
#include <iostream>

#include "client/tool/commands.h"
#include "codec/import/file_io.h"
#include "codec/import/ingest_file.h"

namespace pmcd::tool {

// Named without import:: because clang-format takes a line that begins with "import" for a module's.
using import::ImportedMesh;
using import::ImportResult;

int complain(const char* command, const import::ImportError& error) {
  std::cerr << "pmctool " << command << ": " << import::to_line(error) << '\n';
  return error.code == import::ImportErrorCode::invalid_option ? kExitUsage : kExitBadInput;
}

std::string fixed(double value, int digits) {
  char text[64];
  std::snprintf(text, sizeof text, "%.*f", digits, value);
  return text;
}

std::string error_figure(double error) {
  if (error < 0) return "-";
  if (error == 0) return "0";
  char text[32];
  std::snprintf(text, sizeof text, "%.2e", error);
  return text;
}

std::string hex(std::uint64_t value) {
  char text[17];
  std::snprintf(text, sizeof text, "%016llx", static_cast<unsigned long long>(value));
  return text;
}

void print_table(const std::vector<std::vector<std::string>>& rows, FirstColumn first, const std::string& indent) {
  if (rows.empty()) return;
  std::vector<std::size_t> width(rows.front().size(), 0);
  for (const auto& row : rows) {
    for (std::size_t c = 0; c < row.size(); ++c) width[c] = std::max(width[c], row[c].size());
  }
  for (const auto& row : rows) {
    std::cout << indent;
    for (std::size_t c = 0; c < row.size(); ++c) {
      const std::string space(width[c] - row[c].size(), ' ');
      const bool left = c == 0 && first == FirstColumn::names;
      std::cout << (c > 0 ? "  " : "") << (left ? row[c] + space : space + row[c]);
    }
    std::cout << '\n';
  }
}

bool is_packet_file(const std::string& path) {
  if (import::extension_of(path) == "pmcd") return true;
  std::ifstream file(path, std::ios::binary);
  char magic[4] = {};
  return file.read(magic, sizeof magic) && std::string_view(magic, sizeof magic) == "PMCD";
}

ImportResult<ImportedMesh> load_mesh(const std::string& path, const import::ImportOptions& options) {
  if (!is_packet_file(path)) return import::read_mesh(path, options);
  const auto bytes = import::load_file(path);
  if (!bytes) return bytes.error();
  auto mesh = import::decode_file_bytes(*bytes, std::nullopt, path);
  if (!mesh) return mesh.error();
  ImportedMesh out;
  out.mesh = std::move(mesh).value();
  out.report.format = "pmcd packets";
  out.report.float64 = out.mesh.scalar == codec::Scalar::float64;
  out.report.vertices = out.report.vertices_in_file = out.mesh.positions.size();
  out.report.faces = out.report.polygons_in_file = out.mesh.faces.size();
  return out;
}

}  // namespace pmcd::tool
