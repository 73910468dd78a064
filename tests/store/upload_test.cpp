// SPDX-License-Identifier: MIT
// Uploads: only whole ones in the right order are stored, and what is under way stays within the budget.
#include "daemon/store/upload.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>

#include "tests/store/fake_mesh.h"
#include "tests/store/outcome.h"

namespace pmcd::store {
namespace {

using test::fake_mesh;
using test::FakeMesh;

class UploadTest : public ::testing::Test {
 protected:
  Result<std::unique_ptr<Upload>> begin(const FakeMesh& mesh, const std::string& name = "m", bool replace = false) {
    return Upload::begin(*store_, budget_, name, replace, mesh.directory_bytes());
  }

  /// Sends packets in pieces of `piece` bytes.
  static void send(Upload& upload, const FakeMesh& mesh, std::size_t piece) {
    for (std::size_t packet = 0; packet < mesh.packets.size(); ++packet) {
      const std::span<const std::byte> bytes = mesh.packets[packet];
      for (std::size_t at = 0; at < bytes.size(); at += piece) {
        const Status status = upload.append(static_cast<std::uint32_t>(packet), at,
                                            bytes.subspan(at, std::min(piece, bytes.size() - at)));
        ASSERT_TRUE(status.ok()) << status.error().detail;
      }
    }
  }

  std::size_t files() const {
    const std::filesystem::directory_iterator entries(folder_.path());
    return static_cast<std::size_t>(std::distance(begin_of(entries), std::filesystem::directory_iterator()));
  }
  static std::filesystem::directory_iterator begin_of(std::filesystem::directory_iterator it) { return it; }

  test::TemporaryFolder folder_;
  std::unique_ptr<MeshStore> store_ = MeshStore::open(folder_.file("meshes.db")).value();
  std::shared_ptr<UploadBudget> budget_ = std::make_shared<UploadBudget>(UploadLimits{100'000, 150'000});
};

TEST_F(UploadTest, StoresTheBytesThatCame) {
  const FakeMesh mesh = fake_mesh(1, {100, 5000, 70'000});
  for (const std::size_t piece : {std::size_t{1000}, std::size_t{1} << 20}) {
    auto upload = begin(mesh, "piece " + std::to_string(piece));
    ASSERT_TRUE(upload.ok()) << upload.error().detail;
    EXPECT_TRUE(store_->list().ok());
    send(*upload.value(), mesh, piece);
    const auto inserted = upload.value()->commit(*store_);
    ASSERT_TRUE(inserted.ok()) << inserted.error().detail;
    for (std::size_t level = 0; level < mesh.packets.size(); ++level) {
      EXPECT_EQ(store_->read_packet(inserted.value().mesh.id, static_cast<std::uint32_t>(level)).value(),
                mesh.packets[level]);
    }
  }
}

TEST_F(UploadTest, NothingIsVisibleBeforeCommitAndNothingStaysAfterDropping) {
  const FakeMesh mesh = fake_mesh(1, {100, 5000});
  const std::size_t before = files();
  {
    auto upload = begin(mesh);
    ASSERT_TRUE(upload.ok());
    send(*upload.value(), mesh, 4096);
    EXPECT_TRUE(store_->list().value().meshes.empty());
    EXPECT_EQ(files(), before) << "the spool has no name that a kill could leave behind";
    EXPECT_GT(budget_->taken(), 0U);
  }
  EXPECT_TRUE(store_->list().value().meshes.empty());
  EXPECT_EQ(budget_->taken(), 0U);
}

TEST_F(UploadTest, GapsAndLeftOversAreRefused) {
  const FakeMesh mesh = fake_mesh(2, {100, 200});
  const std::span<const std::byte> first = mesh.packets[0];
  auto upload = begin(mesh);
  ASSERT_TRUE(upload.ok());
  EXPECT_EQ(outcome(upload.value()->append(0, 1, first.first(10))), "incomplete");
  EXPECT_EQ(outcome(upload.value()->append(1, 0, first.first(10))), "incomplete");
  ASSERT_TRUE(upload.value()->append(0, 0, first.first(10)).ok());
  EXPECT_EQ(outcome(upload.value()->append(0, 0, first.first(10))), "incomplete");
  EXPECT_EQ(outcome(upload.value()->append(0, 10, mesh.packets[1])), "bad_packet");
  EXPECT_EQ(outcome(upload.value()->commit(*store_)), "incomplete");
  ASSERT_TRUE(upload.value()->append(0, 10, first.subspan(10)).ok());
  ASSERT_TRUE(upload.value()->append(1, 0, mesh.packets[1]).ok());
  EXPECT_EQ(outcome(upload.value()->append(2, 0, first.first(1))), "bad_packet");
  EXPECT_TRUE(upload.value()->commit(*store_).ok());
}

TEST_F(UploadTest, DamagedPacketIsRefusedAtCommit) {
  FakeMesh mesh = fake_mesh(3, {100, 200});
  mesh.packets[1].back() ^= std::byte{0x80};
  auto upload = begin(mesh);
  ASSERT_TRUE(upload.ok());
  send(*upload.value(), mesh, 64);
  const auto result = upload.value()->commit(*store_);
  ASSERT_FALSE(result.ok());
  EXPECT_EQ(outcome(result), "bad_packet");
  EXPECT_EQ(result.error().detail.substr(0, 28), "packet 1: checksum_mismatch:");
  EXPECT_TRUE(store_->list().value().meshes.empty());
}

TEST_F(UploadTest, NameTakenIsSaidAtOnceAndAgainAtCommit) {
  const FakeMesh mesh = fake_mesh(4, {10});
  auto slow = begin(mesh);
  ASSERT_TRUE(slow.ok());
  auto quick = begin(mesh);
  ASSERT_TRUE(quick.ok());
  send(*quick.value(), mesh, 100);
  ASSERT_TRUE(quick.value()->commit(*store_).ok());
  EXPECT_EQ(outcome(begin(mesh)), "name_taken");
  EXPECT_TRUE(begin(mesh, "m", true).ok());
  send(*slow.value(), mesh, 100);
  EXPECT_EQ(outcome(slow.value()->commit(*store_)), "name_taken");
}

TEST_F(UploadTest, BudgetBoundsEachAndAll) {
  EXPECT_EQ(outcome(begin(fake_mesh(5, {100'000}))), "too_large");
  EXPECT_EQ(budget_->taken(), 0U);
  auto first = begin(fake_mesh(5, {80'000}), "a");
  ASSERT_TRUE(first.ok());
  EXPECT_EQ(outcome(begin(fake_mesh(6, {80'000}), "b")), "too_large");
  EXPECT_TRUE(begin(fake_mesh(6, {60'000}), "b").ok());
  first.value().reset();
  EXPECT_TRUE(begin(fake_mesh(6, {80'000}), "b").ok());
}

TEST_F(UploadTest, BadDirectoriesAreRefused) {
  const FakeMesh mesh = fake_mesh(7, {10, 20});
  const auto good = mesh.directory_bytes();
  const auto try_with = [&](std::span<const std::byte> bytes) {
    const auto upload = Upload::begin(*store_, budget_, "m", false, bytes);
    return upload.ok() ? std::string("taken") : std::string(error_name(upload.error().code));
  };
  EXPECT_EQ(try_with(good), "taken");
  for (std::size_t size = 0; size < good.size(); ++size) {
    EXPECT_EQ(try_with(std::span(good).first(size)), "bad_directory") << size;
  }
  auto longer = good;
  longer.push_back(std::byte{0});
  EXPECT_EQ(try_with(longer), "bad_directory");
  for (std::size_t at = 0; at < good.size(); ++at) {
    auto flipped = good;
    flipped[at] ^= std::byte{1};
    EXPECT_EQ(try_with(flipped), "bad_directory") << at;
  }
  EXPECT_EQ(budget_->taken(), 0U);
}

}  // namespace
}  // namespace pmcd::store
