// SPDX-License-Identifier: MIT
// The calls of a Session: each sends a request, waits for its end, and checks what came.
#include "client/session.h"

#include <utility>

#include "client/session_core.h"
#include "codec/packet/header.h"

namespace pmcd::client {

namespace {

Error failed_transfer(const proto::TransferEnd& end) {
  if (end.result == proto::TransferResult::failed) {
    const proto::CodeInfo* info = proto::find_code(static_cast<std::uint16_t>(end.code));
    return {Failure::refused, end.code,
            "the server could not finish the transfer (" + std::string(proto::code_name(end.code)) + ")" +
                (info == nullptr ? std::string{} : ": " + std::string(info->sentence))};
  }
  return {Failure::violation, proto::ErrorCode::none,
          std::string("the server broke the protocol: a transfer ended as ") + proto::result_name(end.result)};
}

/// Whether the bytes are the packet that the directory announces as number `number`; else what is wrong.
std::optional<std::string> check(const OpenedMesh& mesh, std::uint32_t number, proto::ByteView bytes) {
  const auto header = codec::check_packet(bytes);
  if (!header) return header.error().detail;
  if (header->level != number) return "it is of level " + std::to_string(header->level);
  if (header->generation != mesh.generation) return "it is of another generation";
  if (header->crc32c != mesh.directory.levels[number].crc32c) return "its checksum is not the directory's";
  return std::nullopt;
}

}  // namespace

Session::Session(std::unique_ptr<Core> core) : core_(std::move(core)) {}
Session::Session(Session&&) noexcept = default;

Session& Session::operator=(Session&& other) noexcept {
  if (this != &other) {
    if (core_) core_->close();
    core_ = std::move(other.core_);
  }
  return *this;
}

Session::~Session() {
  if (core_) core_->close();
}

void Session::close() {
  core_->close();
}

const std::string& Session::server_agent() const {
  return core_->server_agent();
}

Result<Session> Session::connect(const Address& address, const Options& options) {
  auto core = std::make_unique<Core>(options);
  if (auto error = core->connect(address)) return *error;
  return Session(std::move(core));
}

Result<proto::MeshPage> Session::list_page(const std::string& filter, const std::string& after, std::uint16_t most) {
  const auto id = core_->start_request(proto::kMaxMeshPageBytes, false);
  if (!id) return id.error();
  core_->transfer(*id)->expect(0, 0, std::nullopt);
  core_->send_request(proto::encode(proto::GetMeshList{*id, filter, after, most}));
  const auto ended = [&] {
    const Transfer* transfer = core_->transfer(*id);
    return transfer == nullptr || transfer->ended();
  };
  if (auto error = core_->wait(ended)) return *error;
  if (auto refusal = core_->take_refusal(*id)) return *refusal;
  const proto::TransferEnd end = core_->transfer(*id)->end();
  const proto::Bytes bytes = core_->transfer(*id)->take_bytes();
  core_->drop(*id);
  if (end.result == proto::TransferResult::failed) return failed_transfer(end);
  if (end.result != proto::TransferResult::complete) return core_->fail(failed_transfer(end));
  auto page = proto::decode_mesh_page(bytes);
  if (!page) {
    return core_->fail(
        {Failure::violation, proto::ErrorCode::none, "the server broke the protocol: " + page.error().detail});
  }
  return std::move(page).value();
}

Result<std::vector<proto::MeshListEntry>> Session::list(const std::string& filter) {
  std::vector<proto::MeshListEntry> entries;
  for (std::string after;;) {
    auto page = list_page(filter, after, 0);
    if (!page) return page.error();
    const bool last = page->remaining == 0;
    if (!last && page->entries.empty()) {
      return core_->fail({Failure::violation, proto::ErrorCode::none,
                          "the server broke the protocol: an empty page of the mesh list that is not the last"});
    }
    for (proto::MeshListEntry& entry : page->entries) {
      if (!after.empty() && entry.name <= after) {
        return core_->fail({Failure::violation, proto::ErrorCode::none,
                            "the server broke the protocol: a page of the mesh list goes back"});
      }
      entries.push_back(std::move(entry));
    }
    if (last) return entries;
    after = entries.back().name;
  }
}

Result<OpenedMesh> Session::open(const std::string& name) {
  const auto id = core_->start_request(core_->options().max_packet_bytes, true);
  if (!id) return id.error();
  core_->send_request(proto::encode(proto::GetBaseMesh{*id, name}));
  if (auto error = core_->wait([&] { return core_->has_opened(*id) || core_->has_refusal(*id); })) return *error;
  auto opened = core_->take_opened(*id);
  if (!opened) return *core_->take_refusal(*id);
  auto& mesh = core_->meshes()[opened->handle];
  if (mesh.base_id) core_->drop(*mesh.base_id);
  mesh = {*opened, 0, *id};
  return std::move(*opened);
}

Result<std::optional<Packet>> Session::next_packet(std::uint32_t handle, const OnProgress& on_progress) {
  if (core_->failure()) return *core_->failure();
  const auto found = core_->meshes().find(handle);
  if (found == core_->meshes().end()) {
    return Error{Failure::no_such_handle, proto::ErrorCode::none,
                 "handle " + std::to_string(handle) + " was not given out in this session"};
  }
  Core::Mesh& mesh = found->second;
  const std::vector<codec::LevelEntry>& levels = mesh.opened.directory.levels;
  const bool all_given_out = mesh.place == levels.size();

  std::uint32_t id = 0;
  if (mesh.base_id) {
    id = *std::exchange(mesh.base_id, std::nullopt);
  } else {
    const auto started = core_->start_request(core_->options().max_packet_bytes, false);
    if (!started) return started.error();
    id = *started;
    // Behind the last packet nothing may come: no packet has 0 bytes.
    core_->transfer(id)->expect(handle, mesh.place, all_given_out ? 0 : levels[mesh.place].bytes);
    core_->send_request(proto::encode(proto::GetNextPacket{id, handle}));
  }

  std::uint64_t told = 0;
  const auto ended = [&] {
    const Transfer* transfer = core_->transfer(id);
    if (transfer == nullptr) return true;
    if (on_progress && transfer->received() != told) {
      told = transfer->received();
      on_progress({mesh.place, told, transfer->total()});
    }
    return transfer->ended();
  };
  if (auto error = core_->wait(ended)) return *error;
  if (auto refusal = core_->take_refusal(id)) return *refusal;
  const proto::TransferEnd end = core_->transfer(id)->end();
  Packet packet{mesh.place, core_->transfer(id)->take_bytes()};
  core_->drop(id);

  if (end.result == proto::TransferResult::failed) return failed_transfer(end);
  if (end.result == proto::TransferResult::end_of_mesh && all_given_out) return std::optional<Packet>{};
  if (end.result != proto::TransferResult::complete) return core_->fail(failed_transfer(end));
  if (const auto wrong = check(mesh.opened, mesh.place, packet.bytes)) {
    return core_->fail({Failure::damaged, proto::ErrorCode::none,
                        "packet " + std::to_string(mesh.place) + " came damaged: " + *wrong});
  }
  ++mesh.place;
  return std::optional<Packet>(std::move(packet));
}

Result<std::chrono::microseconds> Session::ping() {
  if (core_->failure()) return *core_->failure();
  const std::uint32_t id = core_->next_id();
  const auto before = Core::Clock::now();
  core_->send_request(proto::encode(proto::Ping{id}));
  if (auto error = core_->wait([&] { return core_->last_pong() == id; })) return *error;
  return std::chrono::duration_cast<std::chrono::microseconds>(Core::Clock::now() - before);
}

}  // namespace pmcd::client
