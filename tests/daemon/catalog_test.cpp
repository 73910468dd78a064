// SPDX-License-Identifier: MIT
// What the catalog keeps for all sessions: hot packets within their bytes, one read for many who ask, pages of the
// list, and meshes that were replaced or removed for as long as somebody reads them and not longer.
#include "daemon/net/catalog.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <future>
#include <new>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "daemon/net/mesh_index.h"
#include "daemon/store/db.h"
#include "tests/daemon/catalog_fixture.h"
#include "tests/store/fake_mesh.h"
#include "tests/store/outcome.h"

namespace pmcd::net {
namespace {

using std::chrono::hours;
using std::chrono::milliseconds;
using std::chrono::seconds;
using test::fake_mesh;
using test::FakeMesh;

constexpr std::size_t kEntry = PacketCache::kEntryBytes;

SharedBytes bytes_of(std::size_t size) {
  return std::make_shared<const proto::Bytes>(size);
}

/// Which of packets 0 to 9 of mesh 1 are in the cache; looking does not change their order.
std::vector<std::uint32_t> kept(const PacketCache& cache, const std::vector<std::weak_ptr<const proto::Bytes>>& all) {
  std::vector<std::uint32_t> kept;
  for (std::uint32_t i = 0; i < all.size(); ++i) {
    if (!all[i].expired()) kept.push_back(i);
  }
  EXPECT_EQ(cache.packets(), kept.size());
  return kept;
}

TEST(PacketCache, LetsThePacketUsedLongestAgoGo) {
  PacketCache cache(5 * (100 + kEntry));
  std::vector<std::weak_ptr<const proto::Bytes>> all;
  const auto put = [&](std::uint32_t packet) {
    const SharedBytes bytes = bytes_of(100);
    all.emplace_back(bytes);
    cache.put({1, packet}, bytes);
  };
  for (std::uint32_t packet = 0; packet < 5; ++packet) put(packet);
  EXPECT_EQ(kept(cache, all), (std::vector<std::uint32_t>{0, 1, 2, 3, 4}));
  EXPECT_EQ(cache.bytes(), cache.limit());
  EXPECT_NE(cache.find({1, 0}), nullptr);
  EXPECT_NE(cache.find({1, 2}), nullptr);
  put(5);
  EXPECT_EQ(kept(cache, all), (std::vector<std::uint32_t>{0, 2, 3, 4, 5}));
  put(6);
  put(7);
  EXPECT_EQ(kept(cache, all), (std::vector<std::uint32_t>{0, 2, 5, 6, 7}));
  put(8);
  EXPECT_EQ(kept(cache, all), (std::vector<std::uint32_t>{2, 5, 6, 7, 8}));
  EXPECT_EQ(cache.find({1, 0}), nullptr);
}

TEST(PacketCache, IsBoundedByBytes) {
  PacketCache cache(4'000);
  cache.put({1, 0}, bytes_of(1'000 - kEntry));
  EXPECT_EQ(cache.bytes(), 1'000U);
  cache.put({1, 1}, bytes_of(1'001 - kEntry));
  EXPECT_EQ(cache.packets(), 1U) << "more than a quarter of the cache";
  for (std::uint32_t packet = 2; packet < 30; ++packet) {
    cache.put({1, packet}, bytes_of(packet * 10));
    EXPECT_LE(cache.bytes(), cache.limit());
  }
  EXPECT_GT(cache.bytes(), cache.limit() - 1'000);
  cache.put({1, 29}, bytes_of(10));
  EXPECT_EQ(cache.find({1, 29})->size(), 10U) << "the same packet again takes the place of the one before";
  const SharedBytes held = cache.find({1, 28});
  ASSERT_NE(held, nullptr);
  cache.put({2, 0}, bytes_of(50));
  cache.drop(1);
  EXPECT_EQ(cache.packets(), 1U);
  EXPECT_EQ(cache.bytes(), 50 + kEntry);
  EXPECT_NE(cache.find({2, 0}), nullptr);
  EXPECT_EQ(held->size(), 280U) << "who holds a packet goes on holding it";
}

TEST(PacketCache, OfNothingKeepsNothing) {
  PacketCache cache(0);
  cache.put({1, 0}, bytes_of(0));
  EXPECT_EQ(cache.find({1, 0}), nullptr);
}

MeshIndex index_of(const std::vector<std::string>& names) {
  std::vector<store::MeshSummary> meshes;
  for (const std::string& name : names) {
    meshes.emplace_back();
    meshes.back().name = name;
  }
  return MeshIndex(meshes);
}

struct Page {
  std::uint32_t matches;
  std::uint32_t remaining;
  std::vector<std::string> names;
  bool operator==(const Page&) const = default;
};

Page page_of(const MeshIndex& index, const std::string& filter, const std::string& after, std::uint32_t most) {
  const proto::MeshPage page = index.page(filter, after, most);
  Page short_page{page.matches, page.remaining, {}};
  for (const proto::MeshListEntry& entry : page.entries) short_page.names.push_back(entry.name);
  return short_page;
}

TEST(MeshIndex, CutsPages) {
  const MeshIndex index = index_of({"B", "a", "bb", "c", "\xc3\xa9"});
  EXPECT_EQ(page_of(index, "", "", 0), (Page{5, 0, {"B", "a", "bb", "c", "\xc3\xa9"}}));
  EXPECT_EQ(page_of(index, "", "", 2), (Page{5, 3, {"B", "a"}}));
  EXPECT_EQ(page_of(index, "", "a", 2), (Page{5, 1, {"bb", "c"}}));
  EXPECT_EQ(page_of(index, "", "b", 9), (Page{5, 0, {"bb", "c", "\xc3\xa9"}})) << "after a name that is not there";
  EXPECT_EQ(page_of(index, "", "c", 9), (Page{5, 0, {"\xc3\xa9"}})) << "bytes compare as unsigned numbers";
  EXPECT_EQ(page_of(index, "", "\xc3\xa9", 9), (Page{5, 0, {}}));
  EXPECT_EQ(page_of(index_of({}), "", "", 0), (Page{0, 0, {}}));
}

TEST(MeshIndex, FiltersByAPartOfTheNameWithoutCaseInAscii) {
  const MeshIndex index =
      index_of({"Horse", "bunny", "horse-2", "sea HORSE", "\xc3\x89t\xc3\xa9", "\xc3\xa9t\xc3\xa9"});
  EXPECT_EQ(page_of(index, "hOrSe", "", 0), (Page{3, 0, {"Horse", "horse-2", "sea HORSE"}}));
  EXPECT_EQ(page_of(index, "horse", "", 1), (Page{3, 2, {"Horse"}}));
  EXPECT_EQ(page_of(index, "horse", "Horse", 1), (Page{3, 1, {"horse-2"}}));
  EXPECT_EQ(page_of(index, "horse", "bunny", 0), (Page{3, 0, {"horse-2", "sea HORSE"}}));
  EXPECT_EQ(page_of(index, "\xc3\xa9t", "", 0), (Page{1, 0, {"\xc3\xa9t\xc3\xa9"}})) << "beyond ASCII exactly";
  EXPECT_EQ(page_of(index, "T\xc3\xa9", "", 0), (Page{2, 0, {"\xc3\x89t\xc3\xa9", "\xc3\xa9t\xc3\xa9"}}));
  EXPECT_EQ(page_of(index, "nothing", "", 0), (Page{0, 0, {}}));
  EXPECT_EQ(page_of(index, "bunny-long", "", 0), (Page{0, 0, {}}));
}

TEST(MeshIndex, PagesAreBoundedAndNamesThatCannotTravelAreLeftOut) {
  std::vector<std::string> names;
  for (int i = 10'000; i < 12'500; ++i) names.push_back("m" + std::to_string(i));
  names.emplace_back("m\n");
  const MeshIndex index = index_of(names);
  for (const std::uint32_t most : {0U, 1'000U, 1'001U, 65'535U}) {
    const Page page = page_of(index, "", "", most);
    EXPECT_EQ(page.matches, 2'500U);
    EXPECT_EQ(page.remaining, 1'500U);
    EXPECT_EQ(page.names.size(), 1'000U);
    EXPECT_EQ(page_of(index, "M1", "", most), page);
  }
  const Page last = page_of(index, "", "m11999", 0);
  EXPECT_EQ(last.remaining, 0U);
  EXPECT_EQ(last.names.size(), 500U);
  EXPECT_EQ(last.names.back(), "m12499");
}

/// With names of one length the guess is the page, wherever no filter makes it shorter.
TEST(ListSize, IsThePageThatIsMade) {
  std::vector<std::string> names;
  const auto expect_exact = [&](std::uint32_t most) {
    const MeshIndex index = index_of(names);
    EXPECT_EQ(index.size().page_bytes(most), proto::encode_mesh_page(index.page("", "", most)).size()) << names.size();
  };
  for (int i = 10'000; i < 11'200; i += 300) {
    for (const std::uint32_t most : {0U, 1U, 150U, 1'000U, 65'535U}) expect_exact(most);
    for (int n = 0; n < 300; ++n) names.push_back("m" + std::to_string(i + n));
  }
  names = {"a", "long"};
  expect_exact(0);
  EXPECT_EQ(ListSize().page_bytes(0), 92U) << "one mesh, before a list was made";
}

TEST_F(CatalogTest, APacketIsReadOnceAndThenShared) {
  const FakeMesh mesh = fake_mesh(1, {100, 200});
  const store::MeshId id = ingest("m", mesh).mesh.id;
  EXPECT_EQ(catalog_->cached_packet(id, 1), nullptr);
  const SharedBytes first = get(catalog_->read_packet(id, 1)).value();
  EXPECT_EQ(*first, mesh.packets[1]);
  EXPECT_EQ(get(catalog_->read_packet(id, 1)).value(), first) << "the very same bytes, not a copy";
  EXPECT_EQ(catalog_->cached_packet(id, 1), first);
  const CacheStatus status = catalog_->cache_status();
  EXPECT_EQ(status.hits, 2U);
  EXPECT_EQ(status.misses, 1U);
  EXPECT_EQ(status.reads, 1U);
  EXPECT_EQ(status.packets, 1U);
  EXPECT_EQ(status.bytes, mesh.packets[1].size() + kEntry);
  EXPECT_EQ(status.limit_bytes, 1'000'000U);
}

TEST_F(CatalogTest, ManyWhoAskAtTheSameTimeAreOneRead) {
  start({{}, 0, hours(1)});  // without a cache the shared read alone can do it
  const FakeMesh mesh = fake_mesh(2, {100, 300'000});
  const store::MeshId id = ingest("m", mesh).mesh.id;
  constexpr std::size_t kSessions = 64;
  std::vector<std::optional<store::Result<SharedBytes>>> answers(kSessions);
  for (auto& answer : answers) asio::co_spawn(io_, take(catalog_->read_packet(id, 1), answer), asio::detached);
  std::optional<store::Result<SharedBytes>> other;
  asio::co_spawn(io_, take(catalog_->read_packet(id, 0), other), asio::detached);
  run_until([&] {
    return other && std::all_of(answers.begin(), answers.end(), [](const auto& answer) { return answer.has_value(); });
  });
  for (const auto& answer : answers) {
    ASSERT_EQ(store::outcome(*answer), "ok");
    EXPECT_EQ(answer->value(), answers[0]->value());
  }
  EXPECT_EQ(*answers[0]->value(), mesh.packets[1]);
  EXPECT_EQ(*other->value(), mesh.packets[0]);
  EXPECT_EQ(catalog_->cache_status().reads, 2U);
  EXPECT_EQ(catalog_->cache_status().misses, kSessions + 1);
  EXPECT_EQ(read(id, 1), "ok");
  EXPECT_EQ(catalog_->cache_status().reads, 3U) << "what nobody keeps is read again";
}

TEST_F(CatalogTest, ManyWhoAskForAMissingPacketAllGetTheReason) {
  const store::MeshId id = ingest("m", fake_mesh(3, {10, 20})).mesh.id;
  store::Db(folder_.file("meshes.db")).execute("DELETE FROM packet WHERE level = 1");
  std::vector<std::optional<store::Result<SharedBytes>>> answers(3);
  for (auto& answer : answers) asio::co_spawn(io_, take(catalog_->read_packet(id, 1), answer), asio::detached);
  run_until([&] { return answers[0] && answers[1] && answers[2]; });
  for (const auto& answer : answers) EXPECT_EQ(store::outcome(*answer), "missing_packet");
  EXPECT_EQ(catalog_->cache_status().reads, 1U);
  EXPECT_EQ(read(id, 1), "missing_packet");
  EXPECT_EQ(catalog_->cache_status().reads, 2U) << "an error is not kept";
  EXPECT_EQ(read(id, 0), "ok");
}

TEST_F(CatalogTest, ListsInPagesAndSeesEveryChange) {
  EXPECT_EQ(list("", "", 0), proto::MeshPage());
  const FakeMesh mesh = fake_mesh(4, {10, 20});
  for (const char* name : {"b", "a", "Bb"}) ingest(name, mesh);
  const proto::MeshPage all = list("", "", 0);
  ASSERT_EQ(all.entries.size(), 3U);
  EXPECT_EQ(all.entries[0].name, "Bb");
  EXPECT_EQ(all.entries[0].generation, mesh.directory.generation);
  EXPECT_EQ(all.entries[0].bytes, mesh.packets[0].size() + mesh.packets[1].size());
  EXPECT_EQ(all.entries[0].box_max, mesh.directory.box_max);
  const proto::MeshPage page = list("B", "Bb", 1);
  EXPECT_EQ(page.matches, 2U);
  EXPECT_EQ(page.remaining, 0U);
  ASSERT_EQ(page.entries.size(), 1U);
  EXPECT_EQ(page.entries[0].name, "b");
  const auto first = get(catalog_->mesh_list("", "", 0)).value();
  EXPECT_EQ(get(catalog_->mesh_list("", "", 1'000)).value(), first) << "the first page is held encoded";
  EXPECT_EQ(catalog_->mesh_list_bytes(0), first->size()) << "known from the list that was made";
  ASSERT_EQ(remove("a"), "ok");
  EXPECT_EQ(list("", "", 0).matches, 2U);
  EXPECT_EQ(list("A", "", 0).matches, 0U);
  ingest("aa", mesh);
  EXPECT_EQ(list("A", "", 0).matches, 1U);
}

TEST_F(CatalogTest, WhatIsMadeOfAllMeshesIsMadeOnTheReadersThread) {
  for (const char* name : {"b", "a"}) ingest(name, fake_mesh(4, {10}));
  store::Db(folder_.file("meshes.db")).execute("UPDATE mesh SET packets = -1 WHERE name = 'b'");
  std::promise<std::thread::id> reader;
  ASSERT_TRUE(reader_->post([&](store::MeshStore&) { reader.set_value(std::this_thread::get_id()); }));
  std::thread::id maker;
  const auto make = [&maker](const store::MeshList& list) {
    maker = std::this_thread::get_id();
    return list.meshes.at(0).name + " is whole, " + list.damaged.at(0).name + " is damaged";
  };
  EXPECT_EQ(get(catalog_->summarize(make)).value(), "a is whole, b is damaged");
  EXPECT_EQ(maker, reader.get_future().get());
  const auto fail = [](const store::MeshList& list) {
    if (!list.meshes.empty()) throw std::bad_alloc();
    return 1;
  };
  EXPECT_EQ(store::outcome(get(catalog_->summarize(fail))), "out_of_memory");
}

TEST_F(CatalogTest, AMeshIsHeldOnceByAllWhoOpenIt) {
  const FakeMesh mesh = fake_mesh(5, {10, 20});
  ingest("m", mesh);
  const auto held = find("m");
  EXPECT_EQ(find("m"), held);
  EXPECT_EQ(held->directory, mesh.directory_bytes());
  EXPECT_EQ(get(catalog_->find_generation(mesh.directory.generation)).value(), held);
  EXPECT_EQ(store::outcome(get(catalog_->find("n"))), "unknown_mesh");
  EXPECT_EQ(store::outcome(get(catalog_->find_generation(1))), "unknown_mesh");
}

TEST_F(CatalogTest, AMeshThatSomebodyHoldsIsFoundWithoutTheDatabase) {
  ingest("m", fake_mesh(5, {10, 20}));
  const auto held = find("m");
  store::Db(folder_.file("meshes.db")).execute("DELETE FROM packet; DELETE FROM mesh");
  EXPECT_EQ(find("m"), held);
}

TEST_F(CatalogTest, ARetiredMeshIsReadWhileSomebodyHoldsIt) {
  const FakeMesh old_mesh = fake_mesh(6, {10, 20, 30});
  const FakeMesh new_mesh = fake_mesh(7, {10});
  const store::MeshId id = ingest("m", old_mesh).mesh.id;
  auto held = find("m");
  auto held_too = held;
  EXPECT_TRUE(told_.empty());
  EXPECT_EQ(ingest("m", new_mesh).retired, id);
  ASSERT_EQ(told_.size(), 1U);
  EXPECT_EQ(told_[0], (std::pair<store::MeshId, Duration>(id, hours(1))));
  EXPECT_EQ(find("m")->mesh.summary.generation, new_mesh.directory.generation);
  EXPECT_EQ(get(catalog_->find_generation(old_mesh.directory.generation)).value(), held);
  EXPECT_EQ(*get(catalog_->read_packet(id, 1)).value(), old_mesh.packets[1]);
  held.reset();
  EXPECT_EQ(*get(catalog_->read_packet(id, 2)).value(), old_mesh.packets[2]);
  EXPECT_EQ(rows("mesh"), 2);
  EXPECT_EQ(tasks_.running(), 1U);
  held_too.reset();
  EXPECT_TRUE(idle(seconds(10))) << "the last one who let go is what it waits for, not the grace time";
  EXPECT_EQ(rows("mesh"), 1);
  EXPECT_EQ(rows("packet"), 1);
  EXPECT_EQ(read(id, 1), "unknown_mesh");
  EXPECT_EQ(catalog_->cached_packet(id, 1), nullptr);
  EXPECT_EQ(store::outcome(get(catalog_->find_generation(old_mesh.directory.generation))), "unknown_mesh");
}

TEST_F(CatalogTest, ARetiredMeshThatNobodyHoldsIsCollectedAtOnce) {
  const store::MeshId id = ingest("m", fake_mesh(8, {10, 20})).mesh.id;
  find("m");
  ASSERT_EQ(read(id, 1), "ok");
  ASSERT_EQ(remove("m"), "ok");
  EXPECT_EQ(told_.size(), 1U);
  EXPECT_TRUE(idle(seconds(10)));
  EXPECT_EQ(rows("packet"), 0);
  EXPECT_EQ(catalog_->cache_status().packets, 0U);
  EXPECT_EQ(read(id, 1), "unknown_mesh");
}

TEST_F(CatalogTest, AfterTheGraceTimeARetiredMeshIsGoneForItsHoldersToo) {
  start({{}, 1'000'000, milliseconds(50)});
  const FakeMesh mesh = fake_mesh(9, {10, 20});
  const store::MeshId id = ingest("m", mesh).mesh.id;
  const auto held = find("m");
  ASSERT_EQ(read(id, 0), "ok");
  const auto retired_at = Clock::now();
  ASSERT_EQ(remove("m"), "ok");
  ASSERT_EQ(told_.size(), 1U);
  EXPECT_EQ(told_[0].second, milliseconds(50));
  EXPECT_TRUE(idle(seconds(10)));
  EXPECT_GE(Clock::now() - retired_at, milliseconds(50));
  EXPECT_EQ(rows("packet"), 0);
  EXPECT_EQ(catalog_->cached_packet(id, 0), nullptr);
  EXPECT_EQ(read(id, 0), "unknown_mesh");
  EXPECT_EQ(read(id, 1), "unknown_mesh");
}

TEST_F(CatalogTest, AMeshThatGoesWhileItIsReadIsNotKept) {
  const store::MeshId id = ingest("m", fake_mesh(10, {10, 20})).mesh.id;
  // The reader is held up, so that the mesh goes while a packet of it is asked for.
  std::promise<void> go_on;
  ASSERT_TRUE(reader_->post([&](store::MeshStore& store) {
    EXPECT_TRUE(store.list().ok());
    go_on.get_future().wait();
  }));
  std::optional<store::Result<SharedBytes>> answer;
  asio::co_spawn(io_, take(catalog_->read_packet(id, 1), answer), asio::detached);
  ASSERT_EQ(remove("m"), "ok");
  ASSERT_TRUE(idle(seconds(10)));
  EXPECT_FALSE(answer.has_value());
  go_on.set_value();
  run_until([&] { return answer.has_value(); });
  EXPECT_EQ(store::outcome(*answer), "unknown_mesh");
  EXPECT_EQ(catalog_->cache_status().packets, 0U);
}

TEST_F(CatalogTest, LeftoversAreCollectedAtTheStart) {
  const FakeMesh big = fake_mesh(11, {store::kCollectBytes, store::kCollectBytes, 10});
  const FakeMesh small = fake_mesh(12, {10});
  ingest("big", big);
  const auto held_big = find("big");
  ingest("small", small);
  const auto held_small = find("small");
  ASSERT_EQ(remove("big"), "ok");
  ASSERT_EQ(remove("small"), "ok");
  ingest("live", small);
  catalog_->stop();  // as at the end of the daemon: nobody waits for the grace time
  ASSERT_TRUE(idle(seconds(10)));
  EXPECT_EQ(rows("packet"), 5);
  start({{}, 1'000'000, hours(1)});
  asio::co_spawn(io_, catalog_->collect_leftovers(), asio::detached);
  run_until([&] { return tasks_.running() == 1; });
  EXPECT_TRUE(idle(seconds(10)));
  EXPECT_EQ(rows("packet"), 1);
  EXPECT_EQ(rows("mesh"), 1);
  EXPECT_EQ(list("", "", 0).entries.at(0).name, "live");
}

TEST_F(CatalogTest, ACollectionThatFailsIsTriedAgainLaterAndHoldsUpNothing) {
  const FakeMesh mesh = fake_mesh(13, {10});
  const store::MeshId id = ingest("m", mesh).mesh.id;
  const auto held = find("m");
  ASSERT_EQ(remove("m"), "ok");
  // A trigger stands in for a database that refuses.
  store::Db(folder_.file("meshes.db"))
      .execute("CREATE TRIGGER refuse BEFORE DELETE ON mesh BEGIN SELECT raise(ABORT, 'refused'); END");
  start({{}, 1'000'000, hours(1)});
  asio::co_spawn(io_, catalog_->collect_leftovers(), asio::detached);
  run_until([&] { return read(id, 0) == "unknown_mesh"; });
  io_.restart();
  EXPECT_LT(io_.run_for(milliseconds(200)), 20U) << "it does not try again at once, and again, and again";
  EXPECT_EQ(tasks_.running(), 1U) << "but later";
  EXPECT_EQ(rows("mesh"), 1);
  EXPECT_EQ(store::outcome(get(catalog_->find_generation(mesh.directory.generation))), "unknown_mesh")
      << "it is in the database, but may not be read any more";
  ingest("n", fake_mesh(14, {10}));
  EXPECT_EQ(list("", "", 0).matches, 1U);
}

}  // namespace
}  // namespace pmcd::net
