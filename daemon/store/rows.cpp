// SPDX-License-Identifier: MIT
// Columns to members and back.
#include "daemon/store/rows.h"

#include <utility>
#include <vector>

#include "codec/packet/directory.h"

namespace pmcd::store {
namespace {

template <typename Number>
Number narrow(std::int64_t value, const char* what) {
  if (!std::in_range<Number>(value)) {
    throw SqliteError(SQLITE_CORRUPT, std::string(what) + " is out of range in the database");
  }
  return static_cast<Number>(value);
}

codec::Position position(const Statement& row, int column) {
  return {row.real(column), row.real(column + 1), row.real(column + 2)};
}

void bind_measured(Statement& row, int parameter, double error) {
  if (error >= 0) {
    row.bind(parameter, error);
  } else {
    row.bind_null(parameter);
  }
}

}  // namespace

MeshSummary read_summary(const Statement& row) {
  MeshSummary mesh;
  mesh.id = row.integer(0);
  mesh.name = row.text(1);
  mesh.added_at = row.integer(2);
  mesh.generation = static_cast<std::uint64_t>(row.integer(3));
  mesh.format_version = narrow<std::uint8_t>(row.integer(4), "format_version");
  mesh.lossless = row.integer(5) != 0;
  mesh.lattice.scalar = row.integer(6) == 0 ? codec::Scalar::float32 : codec::Scalar::float64;
  mesh.lattice.bits = narrow<unsigned>(row.integer(7), "lattice_bits");
  mesh.lattice.min = position(row, 8);
  mesh.lattice.step = row.real(11);
  mesh.box_min = position(row, 12);
  mesh.box_max = position(row, 15);
  mesh.vertices = narrow<std::uint32_t>(row.integer(18), "vertices");
  mesh.faces = narrow<std::uint32_t>(row.integer(19), "faces");
  mesh.packets = narrow<std::uint32_t>(row.integer(20), "packets");
  mesh.bytes = narrow<std::uint64_t>(row.integer(21), "bytes");
  return mesh;
}

void bind_summary(Statement& row, const MeshSummary& mesh, std::span<const std::byte> directory) {
  row.bind(1, std::string_view(mesh.name));
  row.bind(2, mesh.added_at);
  row.bind(3, static_cast<std::int64_t>(mesh.generation));
  row.bind(4, std::int64_t{mesh.format_version});
  row.bind(5, std::int64_t{mesh.lossless ? 1 : 0});
  row.bind(6, std::int64_t{mesh.lattice.scalar == codec::Scalar::float32 ? 0 : 1});
  row.bind(7, std::int64_t{mesh.lattice.bits});
  for (int axis = 0; axis < 3; ++axis) {
    const auto i = static_cast<std::size_t>(axis);
    row.bind(8 + axis, mesh.lattice.min[i]);
    row.bind(12 + axis, mesh.box_min[i]);
    row.bind(15 + axis, mesh.box_max[i]);
  }
  row.bind(11, mesh.lattice.step);
  row.bind(18, std::int64_t{mesh.vertices});
  row.bind(19, std::int64_t{mesh.faces});
  row.bind(20, std::int64_t{mesh.packets});
  row.bind(21, static_cast<std::int64_t>(mesh.bytes));
  row.bind(22, directory);
}

void complete(const Statement& row, Mesh& mesh) {
  const std::vector<std::byte> directory = row.blob(0);
  if (directory.empty()) {
    for (codec::LevelEntry& level : mesh.levels) level.bits = narrow<std::uint8_t>(mesh.summary.lattice.bits, "bits");
    return;
  }
  const auto parsed = codec::parse_directory(directory);
  if (!parsed || parsed->directory.levels.size() != mesh.levels.size()) {
    throw SqliteError(SQLITE_CORRUPT, "the directory of mesh " + std::to_string(mesh.summary.id) + " is damaged");
  }
  mesh.summary.lattice = parsed->directory.lattice;
  for (std::size_t k = 0; k < mesh.levels.size(); ++k) mesh.levels[k].bits = parsed->directory.levels[k].bits;
}

codec::LevelEntry read_level(const Statement& row, std::int64_t& level) {
  level = row.integer(0);
  codec::LevelEntry entry;
  entry.bytes = narrow<std::uint32_t>(row.integer(1), "bytes");
  entry.vertices = narrow<std::uint32_t>(row.integer(2), "vertices");
  entry.faces = narrow<std::uint32_t>(row.integer(3), "faces");
  entry.crc32c = narrow<std::uint32_t>(row.integer(4), "crc32c");
  entry.error_rms = row.real_or_null(5).value_or(-1);
  entry.error_max = row.real_or_null(6).value_or(-1);
  return entry;
}

void bind_packet(Statement& row, MeshId mesh, std::size_t level, const codec::LevelEntry& entry,
                 std::span<const std::byte> data) {
  row.bind(1, mesh);
  row.bind(2, static_cast<std::int64_t>(level));
  row.bind(3, std::int64_t{entry.bytes});
  row.bind(4, std::int64_t{entry.vertices});
  row.bind(5, std::int64_t{entry.faces});
  row.bind(6, std::int64_t{entry.crc32c});
  bind_measured(row, 7, entry.error_rms);
  bind_measured(row, 8, entry.error_max);
  row.bind(9, data);
}

}  // namespace pmcd::store
