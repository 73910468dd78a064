// SPDX-License-Identifier: MIT
#include "tests/fuzz/memory_source.h"

#include <algorithm>
#include <utility>

#include "daemon/net/mesh_index.h"
#include "tests/fuzz/check.h"
#include "tests/store/fake_mesh.h"

namespace pmcd::fuzz {
namespace {

Content make_content(std::uint64_t seed, const std::vector<std::size_t>& payload_bytes) {
  test::FakeMesh fake = test::fake_mesh(seed, payload_bytes);
  Content content;
  content.directory = fake.directory_bytes();
  content.mesh.levels = fake.directory.levels;
  content.mesh.summary = store::summarize(fake.directory);
  for (auto& packet : fake.packets) {
    content.packets.push_back(std::make_shared<const proto::Bytes>(std::move(packet)));
  }
  return content;
}

store::Error damaged() {
  return {store::ErrorCode::database_corrupt, "the fuzzer says that it is damaged"};
}

store::Error unknown() {
  return {store::ErrorCode::unknown_mesh, "there is no such mesh"};
}

}  // namespace

const std::vector<Content>& contents() {
  // One byte over a packet's header, many small ones, some around the size of a chunk, and more than a channel queues
  // and the kernel takes.
  static const std::vector<Content> all{make_content(1, {1}),           make_content(2, {100, 2'000, 9'000}),
                                        make_content(3, {1, 1, 1, 1}),  make_content(4, {12'000, 10}),
                                        make_content(5, {16, 464, 80}), make_content(6, {6'000})};
  return all;
}

const Content* content_of(std::uint64_t generation) {
  const auto& all = contents();
  const auto it = std::find_if(all.begin(), all.end(), [generation](const Content& content) {
    return content.mesh.summary.generation == generation;
  });
  return it == all.end() ? nullptr : &*it;
}

std::optional<store::MeshId> MemorySource::put(const std::string& name, const Content& content) {
  const auto given_way = live_.find(name) != live_.end() ? std::optional(live_[name]) : std::nullopt;
  if (given_way) retired_.push_back(*given_way);
  const store::MeshId id = next_id_++;
  auto mesh = std::make_shared<net::CatalogMesh>();
  mesh->mesh = content.mesh;
  mesh->mesh.summary.id = id;
  mesh->mesh.summary.name = name;
  mesh->directory = content.directory;
  mesh->profile = net::make_profile(mesh->mesh);
  meshes_[id] = {&content, std::move(mesh), {}};
  live_[name] = id;
  had_.emplace(name, content.mesh.summary.generation);
  return given_way;
}

std::optional<store::MeshId> MemorySource::remove(const std::string& name) {
  was_absent_.insert(name);
  const auto it = live_.find(name);
  if (it == live_.end()) return std::nullopt;
  const store::MeshId id = it->second;
  live_.erase(it);
  retired_.push_back(id);
  return id;
}

void MemorySource::collect(std::size_t index) {
  if (retired_.empty()) return;
  const auto it = retired_.begin() + static_cast<std::ptrdiff_t>(index % retired_.size());
  meshes_.erase(*it);
  retired_.erase(it);
  ++lost_;
}

bool MemorySource::always_there(const std::string& name) const {
  return live_.contains(name) && !was_absent_.contains(name);
}

bool MemorySource::ever_had(const std::string& name, std::uint64_t generation) const {
  return had_.contains({name, generation});
}

net::awaitable<bool> MemorySource::wait(bool lookup) {
  if (!late_) co_return false;
  const auto waiting = std::make_shared<Waiting>(executor_, lookup);
  waiting_.push_back(waiting);
  while (!waiting->done) co_await waiting->answered.wait_until();
  if (waiting->fail) ++failures_;
  co_return waiting->fail;
}

void MemorySource::answer(std::size_t index, bool fail) {
  if (waiting_.empty()) return;
  const auto it = waiting_.begin() + static_cast<std::ptrdiff_t>(index % waiting_.size());
  const std::shared_ptr<Waiting> waiting = *it;
  waiting_.erase(it);
  waiting->done = true;
  waiting->fail = fail;
  waiting->answered.notify();
}

void MemorySource::answer_lookups() {
  for (std::size_t i = 0; i < waiting_.size();) {
    if (waiting_[i]->lookup) {
      answer(i, false);
    } else {
      ++i;
    }
  }
}

void MemorySource::answer_all() {
  while (!waiting_.empty()) answer(0, false);
}

net::awaitable<store::Result<net::SharedBytes>> MemorySource::mesh_list(std::string filter, std::string after,
                                                                        std::uint32_t most) {
  if (co_await wait(true)) co_return damaged();
  std::vector<store::MeshSummary> summaries;
  for (const auto& [name, id] : live_) summaries.push_back(meshes_.at(id).shared->mesh.summary);
  auto page = proto::encode_mesh_page(net::MeshIndex(summaries).page(filter, after, most));
  pages_.insert(page);
  co_return std::make_shared<const proto::Bytes>(std::move(page));
}

std::uint64_t MemorySource::mesh_list_bytes(std::uint32_t most) const {
  return net::ListSize{live_.size(), 0}.page_bytes(most);
}

net::awaitable<store::Result<net::SharedMesh>> MemorySource::find(std::string name) {
  if (co_await wait(true)) co_return damaged();
  const auto it = live_.find(name);
  if (it == live_.end()) {
    was_absent_.insert(name);
    co_return unknown();
  }
  co_return meshes_.at(it->second).shared;
}

net::awaitable<store::Result<net::SharedMesh>> MemorySource::find_generation(std::uint64_t generation) {
  if (co_await wait(true)) co_return damaged();
  for (auto it = meshes_.rbegin(); it != meshes_.rend(); ++it) {
    if (it->second.content->mesh.summary.generation == generation) co_return it->second.shared;
  }
  co_return unknown();
}

net::awaitable<store::Result<net::SharedBytes>> MemorySource::read_packet(store::MeshId mesh, std::uint32_t packet) {
  if (co_await wait(false)) co_return damaged();
  const auto it = meshes_.find(mesh);
  if (it == meshes_.end()) co_return unknown();
  check(packet < it->second.content->packets.size(), "the daemon reads a packet that the mesh does not have");
  if (caching_) it->second.cached.insert(packet);
  co_return it->second.content->packets[packet];
}

net::SharedBytes MemorySource::cached_packet(store::MeshId mesh, std::uint32_t packet) {
  const auto it = meshes_.find(mesh);
  if (it == meshes_.end() || !it->second.cached.contains(packet)) return nullptr;
  return it->second.content->packets.at(packet);
}

}  // namespace pmcd::fuzz
