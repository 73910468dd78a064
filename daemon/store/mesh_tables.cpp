// SPDX-License-Identifier: MIT
// The statements and what is made of their rows.
#include "daemon/store/mesh_tables.h"

#include <algorithm>
#include <cstdio>
#include <utility>

#include "codec/packet/header.h"
#include "daemon/store/rows.h"
#include "daemon/store/schema.h"
#include "daemon/store/wall_clock.h"

namespace pmcd::store {
namespace {

MeshSummary summary_of(const NewMesh& mesh) {
  MeshSummary summary = summarize(mesh.directory);
  summary.name = mesh.name;
  summary.added_at = seconds_since_1970();
  return summary;
}

Error unknown_mesh(std::string_view name) {
  return {ErrorCode::unknown_mesh, "no mesh is named \"" + std::string(name) + "\""};
}

Error unknown_generation(std::uint64_t generation) {
  char digits[17];
  std::snprintf(digits, sizeof digits, "%016llx", static_cast<unsigned long long>(generation));
  return {ErrorCode::unknown_mesh, std::string("no mesh has the generation ") + digits};
}

Error missing_packet(MeshId mesh, std::size_t level) {
  return {ErrorCode::missing_packet,
          "packet " + std::to_string(level) + " of mesh " + std::to_string(mesh) + " is missing in the database"};
}

/// Of the first row of a query that has its parameters, if there is one; the query is reset.
std::optional<MeshSummary> first_summary(Statement& query) {
  const ResetAtExit guard(query);
  if (!query.step()) return std::nullopt;
  return read_summary(query);
}

SqliteError row_missing(MeshId mesh) {
  return {SQLITE_CORRUPT, "the row of mesh " + std::to_string(mesh) + " is missing"};
}

}  // namespace

struct MeshTables::Statements {
  explicit Statements(Db& db)
      : insert_mesh(db, kInsertSummary),
        insert_packet(db, kInsertPacket),
        names(db, "SELECT id, name FROM mesh INDEXED BY mesh_name WHERE retired_at IS NULL ORDER BY name"),
        summary(db, std::string(kSelectSummary) + "WHERE id = ?1"),
        generation(db, "SELECT generation FROM mesh WHERE id = ?1"),
        live(db, "SELECT id FROM mesh WHERE name = ?1 AND retired_at IS NULL"),
        find(db, std::string(kSelectSummary) + "WHERE name = ?1 AND retired_at IS NULL"),
        find_generation(db, std::string(kSelectSummary) +
                                "WHERE generation = ?1 AND collecting = 0 "
                                "ORDER BY retired_at IS NOT NULL, id DESC LIMIT 1"),
        levels(db, kSelectLevels),
        directory(db, kSelectDirectory),
        packet(db, "SELECT crc32c, data FROM packet WHERE mesh = ?1 AND level = ?2"),
        state(db, "SELECT retired_at IS NULL, collecting, packets FROM mesh WHERE id = ?1"),
        retire(db, "UPDATE mesh SET retired_at = ?2 WHERE id = ?1"),
        retired(db, "SELECT id FROM mesh WHERE retired_at IS NOT NULL"),
        sizes(db, "SELECT level, bytes FROM packet WHERE mesh = ?1 ORDER BY level DESC"),
        delete_packets(db, "DELETE FROM packet WHERE mesh = ?1 AND level >= ?2"),
        collecting(db, "UPDATE mesh SET collecting = 1 WHERE id = ?1"),
        delete_mesh(db, "DELETE FROM mesh WHERE id = ?1") {}

  Statement insert_mesh;
  Statement insert_packet;
  Statement names;
  Statement summary;
  Statement generation;
  Statement live;
  Statement find;
  Statement find_generation;
  Statement levels;
  Statement directory;
  Statement packet;
  Statement state;
  Statement retire;
  Statement retired;
  Statement sizes;
  Statement delete_packets;
  Statement collecting;
  Statement delete_mesh;
};

MeshTables::MeshTables(const std::string& path) : db_(path) {}

MeshTables::~MeshTables() = default;

Status MeshTables::prepare() {
  Status status = prepare_database(db_);
  if (status.ok()) statements_ = std::make_unique<Statements>(db_);
  return status;
}

Result<Inserted> MeshTables::insert(const NewMesh& mesh) {
  MeshSummary summary = summary_of(mesh);
  Transaction transaction(db_);
  const std::optional<MeshId> before = live(mesh.name);
  if (before && !mesh.replace) return name_taken(mesh.name);
  if (before) retire(*before);
  const std::vector<std::byte> directory = codec::serialize(mesh.directory);
  bind_summary(statements_->insert_mesh, summary, directory);
  statements_->insert_mesh.run();
  summary.id = db_.last_insert_id();
  for (std::size_t level = 0; level < mesh.packets.size(); ++level) {
    bind_packet(statements_->insert_packet, summary.id, level, mesh.directory.levels[level], mesh.packets[level]);
    statements_->insert_packet.run();
  }
  transaction.commit();
  return Inserted{std::move(summary), before};
}

MeshList MeshTables::list() {
  Statement& names = statements_->names;
  const ResetAtExit guard(names);
  MeshList list;
  while (names.step()) {
    try {
      list.meshes.push_back(summary(names.integer(0)));
    } catch (const SqliteError& error) {
      Error why = error.as_error();
      if (why.code != ErrorCode::database_corrupt) throw;
      list.damaged.push_back({names.text(1), std::move(why)});
    }
  }
  return list;
}

std::optional<MeshId> MeshTables::live(std::string_view name) {
  Statement& query = statements_->live;
  const ResetAtExit guard(query);
  if (!query.bind(1, name).step()) return std::nullopt;
  return query.integer(0);
}

Result<Mesh> MeshTables::find(std::string_view name) {
  auto summary = first_summary(statements_->find.bind(1, name));
  if (!summary) return unknown_mesh(name);
  return with_levels(std::move(*summary));
}

Result<Mesh> MeshTables::find_generation(std::uint64_t generation) {
  auto summary = first_summary(statements_->find_generation.bind(1, static_cast<std::int64_t>(generation)));
  if (!summary) return unknown_generation(generation);
  return with_levels(std::move(*summary));
}

Result<Mesh> MeshTables::with_levels(MeshSummary summary) {
  Statement& query = statements_->levels;
  const ResetAtExit guard(query);
  query.bind(1, summary.id);
  std::vector<codec::LevelEntry> levels;
  while (query.step()) {
    std::int64_t level = 0;
    const codec::LevelEntry entry = read_level(query, level);
    if (level != static_cast<std::int64_t>(levels.size())) break;
    levels.push_back(entry);
  }
  if (levels.size() < summary.packets) return missing_packet(summary.id, levels.size());
  if (levels.size() > summary.packets) {
    throw SqliteError(SQLITE_CORRUPT, "mesh " + std::to_string(summary.id) + " has more packets than it should");
  }
  Mesh mesh{std::move(summary), std::move(levels)};
  Statement& directory = statements_->directory;
  const ResetAtExit directory_guard(directory);
  if (!directory.bind(1, mesh.summary.id).step()) throw row_missing(mesh.summary.id);
  complete(directory, mesh);
  return mesh;
}

Result<std::vector<std::byte>> MeshTables::read_packet(MeshId mesh, std::uint32_t level) {
  Statement& query = statements_->packet;
  const ResetAtExit guard(query);
  if (!query.bind(1, mesh).bind(2, std::int64_t{level}).step()) return why_no_packet(mesh, level);
  std::vector<std::byte> bytes = query.blob(1);
  const auto checked = codec::check_packet(bytes);
  if (!checked || std::int64_t{checked.value().crc32c} != query.integer(0)) {
    return Error{ErrorCode::database_corrupt, "packet " + std::to_string(level) + " of mesh " + std::to_string(mesh) +
                                                  " is damaged in the database"};
  }
  return bytes;
}

Result<Removed> MeshTables::remove(std::string_view name) {
  Transaction transaction(db_);
  const auto mesh = live(name);
  if (!mesh) return unknown_mesh(name);
  const Removed removed{*mesh, generation(*mesh)};
  retire(*mesh);
  transaction.commit();
  return removed;
}

std::vector<MeshId> MeshTables::retired() {
  Statement& query = statements_->retired;
  const ResetAtExit guard(query);
  std::vector<MeshId> meshes;
  while (query.step()) meshes.push_back(query.integer(0));
  return meshes;
}

Collected MeshTables::collect(MeshId mesh) {
  Transaction transaction(db_);
  if (const std::optional<bool> is = is_live(mesh); !is || *is) return is ? Collected::live : Collected::all;
  const std::optional<std::int64_t> first = first_to_delete(mesh);
  if (first) {
    statements_->delete_packets.bind(1, mesh).bind(2, *first).run();
    statements_->collecting.bind(1, mesh).run();
  } else {
    statements_->delete_mesh.bind(1, mesh).run();
  }
  transaction.commit();
  return first ? Collected::part : Collected::all;
}

MeshSummary MeshTables::summary(MeshId mesh) {
  Statement& query = statements_->summary;
  const ResetAtExit guard(query);
  if (!query.bind(1, mesh).step()) throw row_missing(mesh);
  return read_summary(query);
}

std::uint64_t MeshTables::generation(MeshId mesh) {
  Statement& query = statements_->generation;
  const ResetAtExit guard(query);
  if (!query.bind(1, mesh).step()) throw row_missing(mesh);
  return static_cast<std::uint64_t>(query.integer(0));
}

void MeshTables::retire(MeshId mesh) {
  statements_->retire.bind(1, mesh).bind(2, seconds_since_1970()).run();
}

std::optional<bool> MeshTables::is_live(MeshId mesh) {
  Statement& query = statements_->state;
  const ResetAtExit guard(query);
  if (!query.bind(1, mesh).step()) return std::nullopt;
  return query.integer(0) != 0;
}

std::optional<std::int64_t> MeshTables::first_to_delete(MeshId mesh) {
  Statement& query = statements_->sizes;
  const ResetAtExit guard(query);
  query.bind(1, mesh);
  std::optional<std::int64_t> first;
  std::uint64_t bytes = 0;
  while (query.step()) {
    bytes += static_cast<std::uint64_t>(std::max<std::int64_t>(query.integer(1), 0));
    if (first && bytes > kCollectBytes) return first;
    first = query.integer(0);
  }
  return std::nullopt;
}

Error MeshTables::why_no_packet(MeshId mesh, std::uint32_t level) {
  Statement& query = statements_->state;
  const ResetAtExit guard(query);
  const bool gone = !query.bind(1, mesh).step() || query.integer(1) != 0;
  if (gone) return {ErrorCode::unknown_mesh, "the mesh is gone"};
  if (std::int64_t{level} < query.integer(2)) return missing_packet(mesh, level);
  return {ErrorCode::unknown_packet, "the mesh has no packet " + std::to_string(level)};
}

}  // namespace pmcd::store
