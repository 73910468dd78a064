// SPDX-License-Identifier: MIT
// The store's thread: jobs in order, all of them before it ends, and no more than its queue holds.
#include "daemon/store/store_thread.h"

#include <gtest/gtest.h>

#include <future>
#include <vector>

#include "tests/store/fake_mesh.h"
#include "tests/store/outcome.h"

namespace pmcd::store {
namespace {

TEST(StoreThread, RunsJobsInOrderAndAllBeforeItEnds) {
  const test::TemporaryFolder folder;
  std::vector<int> order;
  std::thread::id where;
  {
    auto thread = StoreThread::start(folder.file("meshes.db"));
    ASSERT_TRUE(thread.ok()) << thread.error().detail;
    for (int i = 0; i < 1000; ++i) {
      ASSERT_TRUE(thread.value()->post([&order, &where, i](MeshStore& store) {
        EXPECT_TRUE(store.list().ok());
        where = std::this_thread::get_id();
        order.push_back(i);
      }));
    }
  }
  ASSERT_EQ(order.size(), 1000U);
  for (int i = 0; i < 1000; ++i) EXPECT_EQ(order[static_cast<std::size_t>(i)], i);
  EXPECT_NE(where, std::this_thread::get_id());
}

TEST(StoreThread, SaysWhyItCannotStart) {
  const test::TemporaryFolder folder;
  const auto thread = StoreThread::start(folder.file("no/such/folder/meshes.db"));
  ASSERT_FALSE(thread.ok());
  EXPECT_EQ(outcome(thread), "database_failed");
}

TEST(StoreThread, RefusesMoreThanItsQueueHolds) {
  const test::TemporaryFolder folder;
  auto thread = StoreThread::start(folder.file("meshes.db"));
  ASSERT_TRUE(thread.ok());
  std::promise<void> started;
  std::promise<void> go_on;
  ASSERT_TRUE(thread.value()->post([&](MeshStore&) {
    started.set_value();
    go_on.get_future().wait();
  }));
  started.get_future().wait();
  int ran = 0;
  for (std::size_t i = 0; i < StoreThread::kMaxQueue; ++i) {
    ASSERT_TRUE(thread.value()->post([&](MeshStore&) { ++ran; }));
  }
  EXPECT_FALSE(thread.value()->post([&](MeshStore&) { ++ran; }));
  go_on.set_value();
  thread.value().reset();
  EXPECT_EQ(ran, static_cast<int>(StoreThread::kMaxQueue));
}

}  // namespace
}  // namespace pmcd::store
