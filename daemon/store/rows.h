// SPDX-License-Identifier: MIT
// Rows of the tables as values and values as rows: which column is which member stands here and nowhere else. It runs
// no statement. All functions throw SqliteError, database_corrupt when a row holds what no pmcd wrote.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "daemon/store/db.h"
#include "daemon/store/mesh_store.h"

namespace pmcd::store {

/// What read_summary reads; a WHERE or ORDER BY follows.
inline constexpr const char* kSelectSummary =
    "SELECT id, name, added_at, generation, format_version, lossless, scalar, lattice_bits, lattice_x, lattice_y, "
    "lattice_z, lattice_step, box_min_x, box_min_y, box_min_z, box_max_x, box_max_y, box_max_z, vertices, faces, "
    "packets, bytes FROM mesh ";
MeshSummary read_summary(const Statement& row);

/// With parameters for bind_summary.
inline constexpr const char* kInsertSummary =
    "INSERT INTO mesh (name, added_at, generation, format_version, lossless, scalar, lattice_bits, lattice_x, "
    "lattice_y, lattice_z, lattice_step, box_min_x, box_min_y, box_min_z, box_max_x, box_max_y, box_max_z, vertices, "
    "faces, packets, bytes, directory) "
    "VALUES (?1,?2,?3,?4,?5,?6,?7,?8,?9,?10,?11,?12,?13,?14,?15,?16,?17,?18,?19,?20,?21,?22)";
void bind_summary(Statement& row, const MeshSummary& mesh, std::span<const std::byte> directory);

/// What complete reads, of mesh ?1.
inline constexpr const char* kSelectDirectory = "SELECT ifnull(directory, x'') FROM mesh WHERE id = ?1";
/// Puts into `mesh`, which its other columns and its packets' rows made, what only the stored directory tells: the
/// lattice's unit and the precision of levels. Without one all levels have the lattice's.
void complete(const Statement& row, Mesh& mesh);

/// What read_level reads, of mesh ?1 in ascending order.
inline constexpr const char* kSelectLevels =
    "SELECT level, bytes, vertices, faces, crc32c, error_rms, error_max FROM packet WHERE mesh = ?1 ORDER BY level";
/// The row's level number goes to `level`.
codec::LevelEntry read_level(const Statement& row, std::int64_t& level);

/// With parameters for bind_packet.
inline constexpr const char* kInsertPacket =
    "INSERT INTO packet (mesh, level, bytes, vertices, faces, crc32c, error_rms, error_max, data) "
    "VALUES (?1,?2,?3,?4,?5,?6,?7,?8,?9)";
void bind_packet(Statement& row, MeshId mesh, std::size_t level, const codec::LevelEntry& entry,
                 std::span<const std::byte> data);

}  // namespace pmcd::store
