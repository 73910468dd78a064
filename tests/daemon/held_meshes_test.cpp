// SPDX-License-Identifier: MIT
// Meshes that are found without the database: those that somebody holds, and the last few that were asked for. Keeping
// them puts off nothing: one that is replaced or removed is collected as if nobody had kept it.
#include "daemon/net/held_meshes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <future>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tests/daemon/busy_thread.h"
#include "tests/daemon/catalog_fixture.h"

namespace pmcd::net {
namespace {

using std::chrono::hours;
using std::chrono::seconds;
using test::fake_mesh;
using test::FakeMesh;
using Found = store::Result<SharedMesh>;

class HeldMeshesTest : public CatalogTest {
 protected:
  std::string find_generation(const FakeMesh& mesh) {
    return store::outcome(get(catalog_->find_generation(mesh.directory.generation)));
  }
  /// From now on only what is kept is found.
  void empty_the_database() { store::Db(folder_.file("meshes.db")).execute("DELETE FROM packet; DELETE FROM mesh"); }
  /// What has been asked of the thread is answered; the loop does not know yet.
  static void wait_for(store::StoreThread& thread) {
    std::promise<void> done;
    ASSERT_TRUE(thread.post([&done](store::MeshStore&) { done.set_value(); }));
    done.get_future().wait();
  }
  void turn_the_loop() {
    io_.restart();
    io_.poll();
  }
};

TEST_F(HeldMeshesTest, WhoAsksAgainAndAgainMakesTheDatabaseReadOnce) {
  const FakeMesh mesh = fake_mesh(1, std::vector<std::size_t>(100));
  ingest("m", mesh);
  ASSERT_EQ(find_generation(mesh), "ok");
  ASSERT_EQ(store::outcome(get(catalog_->find("m"))), "ok");
  auto busy = std::make_unique<test::Busy>(*reader_);
  std::vector<std::optional<Found>> answers(100);
  for (std::size_t i = 0; i < answers.size(); ++i) {
    auto ask = i % 2 == 0 ? catalog_->find("m") : catalog_->find_generation(mesh.directory.generation);
    asio::co_spawn(io_, take(std::move(ask), answers[i]), asio::detached);
  }
  turn_the_loop();
  const auto answered = [](const auto& answer) { return answer.has_value(); };
  EXPECT_TRUE(std::all_of(answers.begin(), answers.end(), answered));
  EXPECT_EQ(busy->fill_and_count(), 0U);
  busy.reset();
  run_until([&] { return std::all_of(answers.begin(), answers.end(), answered); });
  for (const auto& answer : answers) EXPECT_EQ(answer->value()->directory, mesh.directory_bytes());
}

TEST_F(HeldMeshesTest, OfThoseThatNobodyHoldsTheLastFewAreKept) {
  static_assert(HeldMeshes::kMostKept == 8);
  std::vector<FakeMesh> meshes;
  for (std::uint64_t i = 0; i < 9; ++i) {
    meshes.push_back(fake_mesh(i, {10}));
    ingest("m" + std::to_string(i), meshes.back());
  }
  for (std::size_t i = 0; i < 8; ++i) EXPECT_EQ(find_generation(meshes[i]), "ok");
  find("m0");
  find("m8");
  empty_the_database();
  std::vector<std::string> found;
  for (const FakeMesh& mesh : meshes) found.push_back(find_generation(mesh));
  EXPECT_EQ(found, (std::vector<std::string>{"ok", "unknown_mesh", "ok", "ok", "ok", "ok", "ok", "ok", "ok"}));
  EXPECT_EQ(store::outcome(get(catalog_->find("m8"))), "ok");
}

TEST_F(HeldMeshesTest, WhatSomebodyHoldsIsFoundByItsContentHoweverManyOthersWereAskedFor) {
  const FakeMesh mesh = fake_mesh(1, {10, 20});
  ingest("m", mesh);
  const auto held = find("m");
  for (std::uint64_t i = 2; i < 12; ++i) {
    ingest(std::to_string(i), fake_mesh(i, {10}));
    find(std::to_string(i));
  }
  empty_the_database();
  const auto found = get(catalog_->find_generation(mesh.directory.generation));
  ASSERT_EQ(store::outcome(found), "ok");
  EXPECT_EQ(found.value(), held);
}

TEST_F(HeldMeshesTest, AKeptMeshThatIsReplacedIsCollectedAtOnce) {
  const FakeMesh old_mesh = fake_mesh(1, {10, 20});
  const FakeMesh new_mesh = fake_mesh(2, {10});
  const store::MeshId id = ingest("m", old_mesh).mesh.id;
  find("m");
  ASSERT_EQ(find_generation(old_mesh), "ok");
  ASSERT_EQ(ingest("m", new_mesh).retired, id);
  EXPECT_TRUE(idle(seconds(10))) << "the grace time is an hour";
  EXPECT_EQ(rows("packet"), 1);
  EXPECT_EQ(find_generation(old_mesh), "unknown_mesh");
  EXPECT_EQ(find("m")->mesh.summary.generation, new_mesh.directory.generation);
}

TEST_F(HeldMeshesTest, AKeptMeshThatIsRemovedIsCollectedWhenItsLastHolderLetsGo) {
  const FakeMesh mesh = fake_mesh(1, {10, 20});
  ingest("m", mesh);
  auto held = find("m");
  ASSERT_EQ(remove("m"), "ok");
  EXPECT_EQ(get(catalog_->find_generation(mesh.directory.generation)).value(), held) << "in its grace time";
  EXPECT_EQ(store::outcome(get(catalog_->find("m"))), "unknown_mesh");
  EXPECT_EQ(rows("mesh"), 1);
  held.reset();
  EXPECT_TRUE(idle(seconds(10)));
  EXPECT_EQ(rows("mesh"), 0);
  EXPECT_EQ(find_generation(mesh), "unknown_mesh");
}

TEST_F(HeldMeshesTest, OfTwoMeshesOfOneContentTheOtherIsFoundWhenOneIsRemoved) {
  const FakeMesh mesh = fake_mesh(1, {10, 20});
  const store::MeshId first = ingest("a", mesh).mesh.id;
  const store::MeshId second = ingest("b", mesh).mesh.id;
  const auto generation = mesh.directory.generation;
  const auto held = find("a");
  EXPECT_EQ(get(catalog_->find_generation(generation)).value()->mesh.summary.id, first) << "nobody holds the other";
  ASSERT_EQ(remove("a"), "ok");
  EXPECT_EQ(get(catalog_->find_generation(generation)).value()->mesh.summary.id, second);
}

TEST_F(HeldMeshesTest, AMeshThatIsRemovedAsItIsFoundIsNotKept) {
  const FakeMesh mesh = fake_mesh(1, {10, 20});
  ingest("m", mesh);
  std::optional<Found> found;
  asio::co_spawn(io_, take(catalog_->find_generation(mesh.directory.generation), found), asio::detached);
  turn_the_loop();
  wait_for(*reader_);
  std::optional<store::Result<store::Removed>> removed;
  asio::co_spawn(io_, take(catalog_->remove("m"), removed), asio::detached);
  run_until([&] { return found.has_value() && removed.has_value(); });
  EXPECT_EQ(store::outcome(*found), "ok");
  EXPECT_EQ(store::outcome(*removed), "ok");
  found.reset();
  EXPECT_TRUE(idle(seconds(10)));
  EXPECT_EQ(rows("mesh"), 0);
  EXPECT_EQ(find_generation(mesh), "unknown_mesh");
}

TEST_F(HeldMeshesTest, WhatAnEarlierRunHasLeftIsNotKeptBeyondItsCollection) {
  const FakeMesh mesh = fake_mesh(1, {10, 20});
  ingest("m", mesh);
  const auto held = find("m");
  ASSERT_EQ(remove("m"), "ok");
  start({{}, 1'000'000, hours(1)});
  EXPECT_EQ(find_generation(mesh), "ok") << "the new catalog does not know yet that it is retired";
  asio::co_spawn(io_, catalog_->collect_leftovers(), asio::detached);
  run_until([&] { return tasks_.running() == 1; });
  EXPECT_TRUE(idle(seconds(10)));
  EXPECT_EQ(rows("mesh"), 0);
  EXPECT_EQ(find_generation(mesh), "unknown_mesh");
}

}  // namespace
}  // namespace pmcd::net
