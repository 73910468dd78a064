// SPDX-License-Identifier: MIT
// MeshStore in SQL. This is the boundary at which SQLite's exceptions become values.
#include "daemon/store/mesh_store.h"

#include <chrono>
#include <new>
#include <optional>
#include <utility>

#include "codec/packet/header.h"
#include "daemon/store/db.h"
#include "daemon/store/schema.h"

namespace pmcd::store {
namespace {

constexpr const char* kSummaryColumns =
    "SELECT id, name, added_at, generation, format_version, lossless, scalar, lattice_bits, lattice_x, lattice_y, "
    "lattice_z, lattice_step, box_min_x, box_min_y, box_min_z, box_max_x, box_max_y, box_max_z, vertices, faces, "
    "packets, bytes FROM mesh ";

/// Runs `work`, which returns a Result, and turns what it throws into an Error.
template <typename Work>
auto guarded(Work&& work) -> decltype(work()) {
  try {
    return work();
  } catch (const SqliteError& error) {
    return error.as_error();
  } catch (const std::bad_alloc&) {
    return Error{ErrorCode::database_failed, "out of memory"};
  }
}

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

MeshSummary summarize(const NewMesh& mesh) {
  MeshSummary summary;
  summary.name = mesh.name;
  summary.added_at =
      std::chrono::duration_cast<std::chrono::seconds>(std::chrono::system_clock::now().time_since_epoch()).count();
  summary.generation = mesh.directory.generation;
  summary.format_version = mesh.directory.format_version;
  summary.lossless = mesh.directory.lossless;
  summary.lattice = mesh.directory.lattice;
  summary.box_min = mesh.directory.box_min;
  summary.box_max = mesh.directory.box_max;
  summary.vertices = mesh.directory.levels.back().vertices;
  summary.faces = mesh.directory.levels.back().faces;
  summary.packets = static_cast<std::uint32_t>(mesh.directory.levels.size());
  for (const codec::LevelEntry& level : mesh.directory.levels) summary.bytes += level.bytes;
  return summary;
}

Error unknown_mesh(std::string_view name) {
  return {ErrorCode::unknown_mesh, "no mesh is named \"" + std::string(name) + "\""};
}

}  // namespace

Error name_taken(std::string_view name) {
  return {ErrorCode::name_taken, "a mesh named \"" + std::string(name) + "\" is in the database already"};
}

/// The connection and its statements, prepared once.
class MeshStore::Connection {
 public:
  explicit Connection(const std::string& path) : db_(path) {}

  Status prepare() {
    Status status = prepare_database(db_);
    if (status.ok()) statements_.emplace(db_);
    return status;
  }

  Result<Inserted> insert(const NewMesh& mesh) {
    MeshSummary summary = summarize(mesh);
    Transaction transaction(db_);
    const bool exists = contains(mesh.name);
    if (exists && !mesh.replace) return name_taken(mesh.name);
    if (exists) statements_->remove.bind(1, mesh.name).run();
    insert_mesh(summary);
    summary.id = db_.last_insert_id();
    for (std::size_t level = 0; level < mesh.packets.size(); ++level) {
      insert_packet(summary.id, level, mesh.directory.levels[level], mesh.packets[level]);
    }
    transaction.commit();
    return Inserted{std::move(summary), exists};
  }

  bool contains(std::string_view name) {
    Statement& query = statements_->find;
    const ResetAtExit guard(query);
    return query.bind(1, name).step();
  }

  std::vector<MeshSummary> list() {
    Statement& query = statements_->list;
    const ResetAtExit guard(query);
    std::vector<MeshSummary> meshes;
    while (query.step()) meshes.push_back(read_summary(query));
    return meshes;
  }

  std::optional<MeshSummary> find(std::string_view name) {
    Statement& query = statements_->find;
    const ResetAtExit guard(query);
    if (!query.bind(1, name).step()) return std::nullopt;
    return read_summary(query);
  }

  std::vector<codec::LevelEntry> levels(const MeshSummary& mesh) {
    Statement& query = statements_->levels;
    const ResetAtExit guard(query);
    query.bind(1, mesh.id);
    std::vector<codec::LevelEntry> levels;
    while (query.step()) {
      if (query.integer(0) != static_cast<std::int64_t>(levels.size())) break;
      codec::LevelEntry level;
      level.bytes = narrow<std::uint32_t>(query.integer(1), "bytes");
      level.vertices = narrow<std::uint32_t>(query.integer(2), "vertices");
      level.faces = narrow<std::uint32_t>(query.integer(3), "faces");
      level.crc32c = narrow<std::uint32_t>(query.integer(4), "crc32c");
      level.error_rms = query.real_or_null(5).value_or(-1);
      level.error_max = query.real_or_null(6).value_or(-1);
      levels.push_back(level);
    }
    if (levels.size() != mesh.packets) {
      throw SqliteError(SQLITE_CORRUPT, "mesh \"" + mesh.name + "\" lacks a packet in the database");
    }
    return levels;
  }

  Result<std::vector<std::byte>> read_packet(MeshId mesh, std::uint32_t level) {
    Statement& query = statements_->packet;
    const ResetAtExit guard(query);
    if (!query.bind(1, mesh).bind(2, std::int64_t{level}).step()) return why_no_packet(mesh, level);
    std::vector<std::byte> bytes = query.blob(1);
    const auto checked = codec::check_packet(bytes);
    if (!checked || checked.value().crc32c != narrow<std::uint32_t>(query.integer(0), "crc32c")) {
      return Error{ErrorCode::database_corrupt, "packet " + std::to_string(level) + " of mesh " + std::to_string(mesh) +
                                                    " is damaged in the database"};
    }
    return bytes;
  }

  Result<MeshSummary> remove(std::string_view name) {
    Transaction transaction(db_);
    const auto mesh = find(name);
    if (!mesh) return unknown_mesh(name);
    statements_->remove.bind(1, name).run();
    transaction.commit();
    return *mesh;
  }

 private:
  struct Statements {
    explicit Statements(Db& db)
        : insert_mesh(db,
                      "INSERT INTO mesh (name, added_at, generation, format_version, lossless, scalar, lattice_bits, "
                      "lattice_x, lattice_y, lattice_z, lattice_step, box_min_x, box_min_y, box_min_z, box_max_x, "
                      "box_max_y, box_max_z, vertices, faces, packets, bytes) "
                      "VALUES (?1,?2,?3,?4,?5,?6,?7,?8,?9,?10,?11,?12,?13,?14,?15,?16,?17,?18,?19,?20,?21)"),
          insert_packet(db,
                        "INSERT INTO packet (mesh, level, bytes, vertices, faces, crc32c, error_rms, error_max, data) "
                        "VALUES (?1,?2,?3,?4,?5,?6,?7,?8,?9)"),
          list(db, std::string(kSummaryColumns) + "ORDER BY name"),
          find(db, std::string(kSummaryColumns) + "WHERE name = ?1"),
          levels(db,
                 "SELECT level, bytes, vertices, faces, crc32c, error_rms, error_max FROM packet WHERE mesh = ?1 "
                 "ORDER BY level"),
          packet(db, "SELECT crc32c, data FROM packet WHERE mesh = ?1 AND level = ?2"),
          mesh_exists(db, "SELECT 1 FROM mesh WHERE id = ?1"),
          remove(db, "DELETE FROM mesh WHERE name = ?1") {}

    Statement insert_mesh;
    Statement insert_packet;
    Statement list;
    Statement find;
    Statement levels;
    Statement packet;
    Statement mesh_exists;
    Statement remove;
  };

  void insert_mesh(const MeshSummary& mesh) {
    Statement& row = statements_->insert_mesh;
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
    row.run();
  }

  void insert_packet(MeshId mesh, std::size_t level, const codec::LevelEntry& entry, std::span<const std::byte> data) {
    Statement& row = statements_->insert_packet;
    row.bind(1, mesh);
    row.bind(2, static_cast<std::int64_t>(level));
    row.bind(3, std::int64_t{entry.bytes});
    row.bind(4, std::int64_t{entry.vertices});
    row.bind(5, std::int64_t{entry.faces});
    row.bind(6, std::int64_t{entry.crc32c});
    bind_measured(row, 7, entry.error_rms);
    bind_measured(row, 8, entry.error_max);
    row.bind(9, data);
    row.run();
  }

  static void bind_measured(Statement& row, int parameter, double error) {
    if (error >= 0) {
      row.bind(parameter, error);
    } else {
      row.bind_null(parameter);
    }
  }

  Error why_no_packet(MeshId mesh, std::uint32_t level) {
    Statement& query = statements_->mesh_exists;
    const ResetAtExit guard(query);
    if (!query.bind(1, mesh).step()) return {ErrorCode::unknown_mesh, "the mesh is gone"};
    return {ErrorCode::unknown_packet, "the mesh has no packet " + std::to_string(level)};
  }

  Db db_;
  std::optional<Statements> statements_;
};

MeshStore::MeshStore(std::string path, std::unique_ptr<Connection> connection)
    : path_(std::move(path)), connection_(std::move(connection)) {}

MeshStore::~MeshStore() = default;

Result<std::unique_ptr<MeshStore>> MeshStore::open(const std::string& path) {
  return guarded([&]() -> Result<std::unique_ptr<MeshStore>> {
    auto connection = std::make_unique<Connection>(path);
    if (const Status status = connection->prepare(); !status.ok()) return status.error();
    return std::unique_ptr<MeshStore>(new MeshStore(path, std::move(connection)));
  });
}

Result<Inserted> MeshStore::insert(const NewMesh& mesh) {
  if (const Status status = check_name(mesh.name); !status.ok()) return status.error();
  if (const Status status = check_mesh(mesh.directory, mesh.packets); !status.ok()) return status.error();
  return guarded([&] { return connection_->insert(mesh); });
}

Result<std::vector<MeshSummary>> MeshStore::list() {
  return guarded([&]() -> Result<std::vector<MeshSummary>> { return connection_->list(); });
}

Result<Mesh> MeshStore::find(std::string_view name) {
  return guarded([&]() -> Result<Mesh> {
    auto summary = connection_->find(name);
    if (!summary) return unknown_mesh(name);
    auto levels = connection_->levels(*summary);
    return Mesh{std::move(*summary), std::move(levels)};
  });
}

Result<bool> MeshStore::contains(std::string_view name) {
  return guarded([&]() -> Result<bool> { return connection_->contains(name); });
}

Result<std::vector<std::byte>> MeshStore::read_packet(MeshId mesh, std::uint32_t level) {
  return guarded([&] { return connection_->read_packet(mesh, level); });
}

Result<MeshSummary> MeshStore::remove(std::string_view name) {
  return guarded([&] { return connection_->remove(name); });
}

}  // namespace pmcd::store
