// SPDX-License-Identifier: MIT
// An open MeshStore in a folder of the test, and what tests ask of it. It judges nothing by itself.
#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "daemon/store/db.h"
#include "daemon/store/mesh_store.h"
#include "tests/store/fake_mesh.h"
#include "tests/store/outcome.h"

namespace pmcd::store {

inline std::vector<std::string> names(const MeshList& list) {
  std::vector<std::string> names;
  for (const MeshSummary& mesh : list.meshes) names.push_back(mesh.name);
  return names;
}

class MeshStoreFixture : public ::testing::Test {
 protected:
  MeshStoreFixture() { reopen(); }

  void reopen() {
    store_.reset();
    auto opened = MeshStore::open(path_);
    ASSERT_TRUE(opened.ok()) << opened.error().detail;
    store_ = std::move(opened).value();
  }

  Result<Inserted> insert(const std::string& name, const test::FakeMesh& mesh, bool replace = false) {
    const auto spans = mesh.spans();
    return store_->insert({name, replace, mesh.directory, spans});
  }

  /// The code with which `mesh` is refused, after a check that nothing of it is there.
  ErrorCode refused(const test::FakeMesh& mesh) {
    const auto result = insert("refused", mesh);
    EXPECT_FALSE(result.ok());
    if (result.ok()) return ErrorCode::database_failed;
    EXPECT_FALSE(result.error().detail.empty());
    EXPECT_TRUE(store_->list().value().meshes.empty());
    EXPECT_EQ(Db(path_).number("SELECT count(*) FROM packet"), 0);
    return result.error().code;
  }

  void expect_equal(const std::string& name, const test::FakeMesh& mesh) {
    const auto found = store_->find(name);
    ASSERT_TRUE(found.ok()) << found.error().detail;
    const MeshSummary& summary = found.value().summary;
    EXPECT_EQ(summary.name, name);
    EXPECT_EQ(summary.generation, mesh.directory.generation);
    EXPECT_EQ(summary.format_version, mesh.directory.format_version);
    EXPECT_EQ(summary.lossless, mesh.directory.lossless);
    EXPECT_EQ(summary.lattice.scalar, mesh.directory.lattice.scalar);
    EXPECT_EQ(summary.lattice.bits, mesh.directory.lattice.bits);
    EXPECT_EQ(summary.lattice.min, mesh.directory.lattice.min);
    EXPECT_EQ(summary.lattice.step, mesh.directory.lattice.step);
    EXPECT_EQ(summary.box_min, mesh.directory.box_min);
    EXPECT_EQ(summary.box_max, mesh.directory.box_max);
    EXPECT_EQ(summary.vertices, mesh.directory.levels.back().vertices);
    EXPECT_EQ(summary.faces, mesh.directory.levels.back().faces);
    EXPECT_EQ(summary.packets, mesh.packets.size());
    std::uint64_t bytes = 0;
    ASSERT_EQ(found.value().levels.size(), mesh.packets.size());
    for (std::size_t level = 0; level < mesh.packets.size(); ++level) {
      const codec::LevelEntry& got = found.value().levels[level];
      const codec::LevelEntry& expected = mesh.directory.levels[level];
      EXPECT_EQ(got.bytes, expected.bytes);
      EXPECT_EQ(got.vertices, expected.vertices);
      EXPECT_EQ(got.faces, expected.faces);
      EXPECT_EQ(got.bits, expected.bits);
      EXPECT_EQ(got.crc32c, expected.crc32c);
      EXPECT_EQ(got.error_rms, expected.error_rms);
      EXPECT_EQ(got.error_max, expected.error_max);
      const auto packet = store_->read_packet(summary.id, static_cast<std::uint32_t>(level));
      ASSERT_TRUE(packet.ok()) << packet.error().detail;
      EXPECT_EQ(packet.value(), mesh.packets[level]);
      bytes += expected.bytes;
    }
    EXPECT_EQ(summary.bytes, bytes);
  }

  test::TemporaryFolder folder_;
  std::string path_ = folder_.file("meshes.db");
  std::unique_ptr<MeshStore> store_;
};

}  // namespace pmcd::store
