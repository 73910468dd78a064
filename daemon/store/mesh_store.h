// SPDX-License-Identifier: MIT
// The mesh database: packet blobs and what is known of each mesh. A mesh is stored in one transaction, whole and
// checked, or not at all; what insert() confirmed survives kill -9 and loss of power. A mesh that is replaced or
// removed is retired: its name is free at once and no list shows it, but its packets can be read until it is collected.
// Thread rule: used by the thread that opened it (store_thread.h has one for the daemon). It knows no sessions.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "codec/packet/directory.h"
#include "daemon/store/result.h"

namespace pmcd::store {

/// Names one ingest of one mesh; never reused, so a mesh that was replaced under the same name has another id.
using MeshId = std::int64_t;

/// One line of the mesh list.
struct MeshSummary {
  MeshId id = 0;
  std::string name;
  std::int64_t added_at = 0;  ///< seconds since 1970
  std::uint64_t generation = 0;
  std::uint8_t format_version = 0;
  bool lossless = false;
  codec::Lattice lattice;
  codec::Position box_min{0, 0, 0};
  codec::Position box_max{0, 0, 0};
  std::uint32_t vertices = 0;  ///< of the last level
  std::uint32_t faces = 0;
  std::uint32_t packets = 0;
  std::uint64_t bytes = 0;  ///< of all packets
};

/// A mesh of which the database holds no usable row any more.
struct DamagedMesh {
  std::string name;
  Error error;
};

struct MeshList {
  std::vector<MeshSummary> meshes;
  std::vector<DamagedMesh> damaged;  ///< what `meshes` lacks therefore
};

/// A mesh with its level directory.
struct Mesh {
  MeshSummary summary;
  std::vector<codec::LevelEntry> levels;  ///< one for each packet
};

/// What is to be stored. The spans must stay as they are during insert().
struct NewMesh {
  std::string_view name;
  bool replace = false;  ///< a mesh of this name gives way
  const codec::Directory& directory;
  std::span<const std::span<const std::byte>> packets;
};

struct Inserted {
  MeshSummary mesh;
  std::optional<MeshId> retired;  ///< the mesh of that name that gave way
  [[nodiscard]] bool replaced() const { return retired.has_value(); }
};

struct Removed {
  MeshId mesh = 0;
  std::uint64_t generation = 0;
};

/// What a step of collect() came to.
enum class Collected : std::uint8_t {
  all,   ///< nothing of the mesh is left
  part,  ///< some packets are deleted; call again
  live,  ///< the mesh is not retired; nothing was done
};

inline constexpr std::size_t kMaxNameBytes = 255;
inline constexpr std::size_t kMaxLevels = 1'001;
/// SQLite holds no larger blob.
inline constexpr std::uint64_t kMaxPacketBytes = 1'000'000'000;
/// What one step of collect() deletes at most, unless a single packet is larger.
inline constexpr std::uint64_t kCollectBytes = std::uint64_t{16} << 20;

/// Whether a name fits the database: 1 to kMaxNameBytes bytes. What else makes a good name is for the protocol to say.
/// Error: bad_name.
Status check_name(std::string_view name);

/// Whether this pmcd stores such a directory. Errors: bad_directory, too_large.
Status check_directory(const codec::Directory& directory);

/// The same, and whether the packets are whole, in order, of one mesh and what the directory says of them.
/// Errors: bad_directory, bad_packet, too_large.
Status check_mesh(const codec::Directory& directory, std::span<const std::span<const std::byte>> packets);

/// What a directory says of its mesh. REQUIRES: it has a level. Name, id and time are left to the caller.
MeshSummary summarize(const codec::Directory& directory);

/// The error of a name that is in use.
Error name_taken(std::string_view name);

class MeshTables;
class RuleHistory;

class MeshStore {
 public:
  /// Opens the database, or makes an empty one. Errors: those of files and SQLite, database_newer, not_a_database.
  static Result<std::unique_ptr<MeshStore>> open(const std::string& path);
  ~MeshStore();
  MeshStore(const MeshStore&) = delete;
  MeshStore& operator=(const MeshStore&) = delete;

  /// Checks and stores a mesh; once this returns, it is on the disk. On error nothing changed.
  /// Errors: those of check_name and check_mesh, name_taken, no_space, and those of SQLite.
  Result<Inserted> insert(const NewMesh& mesh);

  /// All live meshes by name (bytewise). A damaged one does not hide the others.
  Result<MeshList> list();
  /// The live mesh of that name. Errors: unknown_mesh, missing_packet, database_corrupt.
  Result<Mesh> find(std::string_view name);
  /// A mesh of that content: the newest live one, else the newest retired one that is not being collected.
  /// Errors: those of find().
  Result<Mesh> find_generation(std::uint64_t generation);
  /// True if a live mesh has this name.
  Result<bool> contains(std::string_view name);
  /// The bytes of one packet of a live or retired mesh, whole and checked against its checksum.
  /// Errors: unknown_mesh (also when it is being collected), unknown_packet, missing_packet, database_corrupt.
  Result<std::vector<std::byte>> read_packet(MeshId mesh, std::uint32_t level);

  /// Retires the mesh of that name, also a damaged one, and tells what it was. Error: unknown_mesh.
  Result<Removed> remove(std::string_view name);
  /// The meshes that wait to be collected, in no order.
  Result<std::vector<MeshId>> retired();
  /// Deletes a retired mesh, about kCollectBytes a call so that others may write in between; from the first call on
  /// find_generation does not see it. What a kill leaves is still retired. A mesh that is gone is Collected::all.
  Result<Collected> collect(MeshId mesh);

  /// The history of rule changes in the same database (rule_history.h); lives as long as the store.
  [[nodiscard]] RuleHistory& rules() { return *rules_; }

  [[nodiscard]] const std::string& path() const { return path_; }

 private:
  MeshStore(std::string path, std::unique_ptr<MeshTables> tables);

  std::string path_;
  std::unique_ptr<MeshTables> tables_;
  std::unique_ptr<RuleHistory> rules_;  ///< over the connection of tables_
};

}  // namespace pmcd::store
