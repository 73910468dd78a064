// SPDX-License-Identifier: MIT
// The calls of a Session: each sends a request, waits for its end, and checks what came.
#include "client/session.h"

#include <algorithm>
#include <utility>

#include "client/failed_transfer.h"
#include "client/packet_check.h"
#include "client/session_core.h"

namespace pmcd::client {

namespace {

/// Whether the mesh has the packet, and more of it than was begun.
bool in_range(const codec::Directory& directory, std::uint32_t packet, std::size_t begun) {
  return packet < directory.levels.size() && begun < directory.levels[packet].bytes;
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

Result<OpenedMesh> Session::open(const std::string& name) {
  const auto id = core_->start_request(core_->options().max_packet_bytes);
  if (!id) return id.error();
  core_->expect_opened(*id, 0);
  core_->send_request(proto::encode(proto::GetBaseMesh{*id, name}));
  if (auto error = core_->wait([&] { return core_->has_opened(*id) || core_->has_refusal(*id); })) return *error;
  auto opened = core_->take_opened(*id);
  if (!opened) return *core_->take_refusal(*id);
  Core::Mesh& mesh = core_->meshes()[opened->handle];
  if (mesh.asked) core_->drop(*mesh.asked);
  mesh = {*opened, 0, *id, {}};
  return std::move(*opened);
}

Result<OpenedMesh> Session::resume(std::uint64_t generation, std::uint32_t packet, proto::Bytes begun) {
  if (core_->failure()) return *core_->failure();
  const auto known = std::find_if(core_->meshes().begin(), core_->meshes().end(),
                                  [&](const auto& entry) { return entry.second.opened.generation == generation; });
  const bool is_known = known != core_->meshes().end();
  const std::size_t offset = begun.size();
  if (is_known && !in_range(known->second.opened.directory, packet, offset)) {
    return Error{Failure::refused, proto::ErrorCode::bad_range,
                 "the mesh has no byte " + std::to_string(offset) + " of packet " + std::to_string(packet)};
  }
  const auto id = core_->start_request(core_->options().max_packet_bytes, std::move(begun));
  if (!id) return id.error();
  if (is_known) {
    Core::Mesh& mesh = known->second;
    if (mesh.asked) core_->drop(*mesh.asked);
    core_->transfer(*id)->expect(mesh.opened.handle, packet, mesh.opened.directory.levels[packet].bytes);
    core_->send_request(proto::encode(proto::GetPacket{*id, generation, packet, offset}));
    mesh.place = packet;
    mesh.asked = *id;
    mesh.begun = {};
    return mesh.opened;
  }
  core_->expect_opened(*id, packet);
  core_->send_request(proto::encode(proto::GetPacket{*id, generation, packet, offset}));
  if (auto error = core_->wait([&] { return core_->has_opened(*id) || core_->has_refusal(*id); })) {
    core_->meshes()[0].asked = *id;  // no mesh has handle 0: for take_partial
    return *error;
  }
  auto opened = core_->take_opened(*id);
  if (!opened) return *core_->take_refusal(*id);
  if (opened->generation != generation) {
    return core_->fail({Failure::violation, proto::ErrorCode::none,
                        "the server broke the protocol: it opened another generation than the one asked for"});
  }
  core_->meshes()[opened->handle] = {*opened, packet, *id, {}};
  return std::move(*opened);
}

Result<std::optional<Packet>> Session::next_packet(std::uint32_t handle, const OnProgress& on_progress,
                                                   const std::stop_token& cancel) {
  const auto found = core_->meshes().find(handle);
  // What came before the session ended is still told, and given if it is whole.
  if (core_->failure() && (handle == 0 || found == core_->meshes().end() || !found->second.asked)) {
    return *core_->failure();
  }
  if (found == core_->meshes().end() || handle == 0) {
    return Error{Failure::no_such_handle, proto::ErrorCode::none,
                 "handle " + std::to_string(handle) + " was not given out in this session"};
  }
  Core::Mesh& mesh = found->second;
  const auto asked = core_->ask_for_next(mesh);
  if (!asked) return asked.error();
  const std::uint32_t id = *asked;
  const bool all_given_out = mesh.place == mesh.opened.directory.levels.size();

  std::uint64_t told = core_->transfer(id) == nullptr ? 0 : core_->transfer(id)->begun();
  bool unwanted = false;
  const auto look = [&] {
    const Transfer* transfer = core_->transfer(id);
    if (transfer == nullptr) return true;
    if (on_progress && transfer->received() != told) {
      const proto::ByteView fresh = transfer->bytes().subspan(static_cast<std::size_t>(told));
      told = transfer->received();
      if (!on_progress({mesh.place, told, transfer->total(), fresh})) unwanted = true;
    }
    if (cancel.stop_requested()) unwanted = true;
    return transfer->ended();
  };
  {
    const std::stop_callback wake(cancel, [this] { core_->wake(); });
    bool cancelled = false;
    std::optional<Error> error = core_->wait([&] { return look() || unwanted; });
    if (!error && unwanted && !look()) {
      cancelled = true;
      core_->send_request(proto::encode(proto::Cancel{id}));
      error = core_->wait(look, core_->options().silence_timeout);
    }
    if (error) {
      look();  // what the end of the line still brought
      return *error;
    }
    unwanted = cancelled;
  }

  mesh.asked.reset();
  if (auto refusal = core_->take_refusal(id)) return *refusal;
  const proto::TransferEnd end = core_->transfer(id)->end();
  proto::Bytes bytes = core_->transfer(id)->take_bytes();
  core_->drop(id);

  if (end.result == proto::TransferResult::failed) return failed_transfer(end);
  if (end.result == proto::TransferResult::end_of_mesh && all_given_out) return std::optional<Packet>{};
  if (end.result == proto::TransferResult::cancelled && unwanted) {
    mesh.begun = std::move(bytes);
    return Error{Failure::cancelled, proto::ErrorCode::none,
                 "packet " + std::to_string(mesh.place) + " was cancelled as asked"};
  }
  if (end.result != proto::TransferResult::complete) return core_->fail(failed_transfer(end));
  if (const auto wrong = wrong_with_packet(mesh.opened.directory, mesh.place, bytes)) {
    return core_->fail({Failure::damaged, proto::ErrorCode::none,
                        "packet " + std::to_string(mesh.place) + " came damaged: " + *wrong});
  }
  return std::optional<Packet>(Packet{mesh.place++, std::move(bytes)});
}

proto::Bytes Session::take_partial(std::uint32_t handle) {
  const auto found = core_->meshes().find(handle);
  if (found == core_->meshes().end()) return {};
  Core::Mesh& mesh = found->second;
  if (mesh.asked && core_->failure()) {
    Transfer* transfer = core_->transfer(*mesh.asked);
    return transfer == nullptr ? proto::Bytes{} : transfer->take_bytes();
  }
  return std::exchange(mesh.begun, {});
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
