// SPDX-License-Identifier: MIT
// A catalog with its database and threads, for tests of what it keeps and lets go.
#pragma once

#include <gtest/gtest.h>

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "daemon/net/catalog.h"
#include "daemon/store/db.h"
#include "proto/mesh_list.h"
#include "tests/store/fake_mesh.h"
#include "tests/store/outcome.h"
//
#include <boost/asio/detached.hpp>

namespace pmcd::net {

/// A catalog over a database of its own; its loop runs in the test's thread, as far as a test lets it.
class CatalogTest : public ::testing::Test {
 protected:
  CatalogTest() { start({{}, 1'000'000, std::chrono::hours(1)}); }
  ~CatalogTest() override {
    catalog_->stop();
    EXPECT_TRUE(idle(std::chrono::seconds(10))) << "a task of the catalog did not end";
  }

  /// A new catalog over the same database.
  void start(const CatalogOptions& options) {
    if (catalog_) {
      catalog_->stop();
      EXPECT_TRUE(idle(std::chrono::seconds(10))) << "a task of the catalog before did not end";
    }
    catalog_ = std::make_unique<Catalog>(tasks_, *reader_, *writer_, options);
    catalog_->on_retired([this](store::MeshId mesh, Duration grace) { told_.emplace_back(mesh, grace); });
  }

  /// The answer of a coroutine; the loop runs until it is there.
  template <typename T>
  T get(awaitable<T> work) {
    std::optional<T> answer;
    asio::co_spawn(io_, take(std::move(work), answer), asio::detached);
    run_until([&] { return answer.has_value(); });
    return std::move(*answer);
  }
  template <typename T>
  static awaitable<void> take(awaitable<T> work, std::optional<T>& answer) {
    answer.emplace(co_await std::move(work));
  }

  template <typename Done>
  void run_until(Done done) {
    const auto limit = Clock::now() + std::chrono::seconds(20);
    while (!done()) {
      io_.restart();
      io_.run_one_for(std::chrono::milliseconds(50));
      ASSERT_LT(Clock::now(), limit) << "what was waited for did not happen";
    }
  }

  /// Whether all tasks of the catalog end within `limit`.
  bool idle(Duration limit) { return get(tasks_.wait_idle(limit)); }

  store::Inserted ingest(const std::string& name, const test::FakeMesh& mesh) {
    auto begun = get(catalog_->begin_upload(name, true, mesh.directory_bytes()));
    EXPECT_EQ(store::outcome(begun), "ok");
    for (std::uint32_t packet = 0; packet < mesh.packets.size(); ++packet) {
      EXPECT_EQ(store::outcome(get(catalog_->append(begun.value(), packet, 0, mesh.packets[packet]))), "ok");
    }
    auto inserted = get(catalog_->commit(begun.value()));
    EXPECT_EQ(store::outcome(inserted), "ok");
    return inserted.value();
  }

  std::string remove(const std::string& name) { return store::outcome(get(catalog_->remove(name))); }

  std::shared_ptr<const CatalogMesh> find(const std::string& name) {
    auto found = get(catalog_->find(name));
    EXPECT_EQ(store::outcome(found), "ok");
    return found.ok() ? found.value() : nullptr;
  }

  std::string read(store::MeshId mesh, std::uint32_t packet) {
    return store::outcome(get(catalog_->read_packet(mesh, packet)));
  }

  proto::MeshPage list(const std::string& filter, const std::string& after, std::uint32_t most) {
    const auto bytes = get(catalog_->mesh_list(filter, after, most));
    EXPECT_EQ(store::outcome(bytes), "ok");
    return proto::decode_mesh_page(*bytes.value()).value();
  }

  std::int64_t rows(const char* table) {
    return store::Db(folder_.file("meshes.db")).number((std::string("SELECT count(*) FROM ") + table).c_str());
  }

  test::TemporaryFolder folder_;
  asio::io_context io_{1};  // before the threads, which post to it to their end
  std::unique_ptr<store::StoreThread> writer_ = store::StoreThread::start(folder_.file("meshes.db")).value();
  std::unique_ptr<store::StoreThread> reader_ = store::StoreThread::start(folder_.file("meshes.db")).value();
  TaskGroup tasks_{io_.get_executor()};
  std::unique_ptr<Catalog> catalog_;
  std::vector<std::pair<store::MeshId, Duration>> told_;
};

}  // namespace pmcd::net
