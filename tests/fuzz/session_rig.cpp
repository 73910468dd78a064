// SPDX-License-Identifier: MIT
#include "tests/fuzz/session_rig.h"

#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <utility>

#include "daemon/scheduler/registry.h"
#include "tests/fuzz/check.h"

namespace pmcd::fuzz {
namespace {

constexpr std::size_t kAll = std::size_t{1} << 20;

/// Time does not pass here: what a script does is to be the same at each run.
net::Limits patient_limits(const RigOptions& options) {
  net::Limits limits;
  limits.meshes_per_session = 6;
  for (auto* time : {&limits.hello, &limits.join, &limits.stall, &limits.rate_window, &limits.linger}) {
    *time = std::chrono::hours(1);
  }
  limits.min_rate = 0;
  limits.least_chunk_bytes = limits.first_chunk_bytes = limits.most_chunk_bytes = options.chunk_bytes;
  limits.queued_bytes = options.queued_bytes;
  limits.queued_frames = 200;
  return limits;
}

}  // namespace

bool Line::flush(std::size_t most) {
  if (!is_open() || out_.empty()) return false;
  const proto::Bytes piece(out_.begin(), out_.begin() + static_cast<std::ptrdiff_t>(std::min(most, out_.size())));
  const ssize_t count = ::send(socket_, piece.data(), piece.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
  if (count <= 0) return false;
  out_.erase(out_.begin(), out_.begin() + count);
  return true;
}

bool Line::receive(std::size_t most) {
  if (!is_open() || ended_ || most == 0) return false;
  std::array<std::byte, 4'096> buffer;
  const ssize_t count = ::recv(socket_, buffer.data(), std::min(most, buffer.size()), MSG_DONTWAIT);
  if (count == 0) ended_ = true;
  if (count <= 0) return false;
  in_.insert(in_.end(), buffer.begin(), buffer.begin() + count);
  return true;
}

std::optional<proto::Frame> Line::next() {
  while (true) {
    if (left_.empty()) {
      if (in_.empty()) return std::nullopt;
      being_cut_ = std::exchange(in_, {});
      left_ = being_cut_;
    }
    const auto frame = reader_.next(left_);
    check(frame.ok(), "the server sends what is no frame");
    if (frame.value()) return *frame.value();
  }
}

void Line::close() {
  if (is_open()) ::close(socket_);
  socket_ = -1;
}

SessionRig::SessionRig(const RigOptions& options)
    : limits_(patient_limits(options)),
      socket_buffer_(options.socket_buffer),
      tasks_(io_.get_executor()),
      source_(io_.get_executor()),
      dispatcher_(options.policy, source_, tasks_, limits_),
      answers_(tasks_, limits_),
      context_{source_, dispatcher_, tokens_, answers_, limits_, 1, "fuzzed", false} {}

SessionRig::~SessionRig() = default;

std::shared_ptr<net::Channel> SessionRig::make_channel(std::unique_ptr<Line>& line, std::uint32_t max_frame) {
  std::array<int, 2> ends{};
  check(::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends.data()) == 0, "no pair of sockets");
  ::setsockopt(ends[0], SOL_SOCKET, SO_SNDBUF, &socket_buffer_, sizeof socket_buffer_);
  line = std::make_unique<Line>(ends[1], max_frame);
  net::StreamSocket socket(io_.get_executor(), net::asio::generic::stream_protocol(AF_UNIX, 0), ends[0]);
  return std::make_shared<net::Channel>(std::move(socket), limits_, proto::kMaxClientFrame, 256);
}

std::size_t SessionRig::connect() {
  auto client = std::make_unique<Client>(source_, limits_);
  auto channel = make_channel(client->request, proto::kMaxAnswerFrame);
  client->key = clients_.size() + 1;
  client->request_channel = channel;
  auto session = std::make_shared<net::Session>(client->key, "fuzzer", std::move(channel), context_);
  client->session = session;
  net::Session& started = *session;
  tasks_.spawn("session", started.run(std::move(session)));
  clients_.push_back(std::move(client));
  return clients_.size() - 1;
}

// What Server::serve_data does, without a deadline; the rig sends no other first frame than the right one.
net::awaitable<void> SessionRig::serve_data(std::shared_ptr<net::Channel> channel) {
  const net::Channel::Incoming incoming = co_await channel->read();
  const auto* frame = std::get_if<proto::Frame>(&incoming);
  const auto join = proto::decode<proto::Join>(frame != nullptr ? frame->body : proto::ByteView());
  const auto session = join ? tokens_.redeem(join.value().token) : nullptr;
  if (session) {
    co_await session->run_data(std::move(channel));
  } else {
    co_await channel->finish();
  }
}

void SessionRig::join(std::size_t number) {
  Client& client = *clients_[number];
  // Everything that was sent before is to be judged as before the join.
  settle(false);
  if (client.data || !client.model.token() || client.model.must_end()) return;
  if (client.model.state() != proto::SessionState::greeted) return;
  auto channel = make_channel(client.data, proto::kMaxDataFrame);
  client.data_channel = channel;
  tasks_.spawn("data channel", serve_data(std::move(channel)));
  const proto::Bytes frame = proto::encode(proto::Join{{}, *client.model.token()});
  send(number, proto::Channel::data, frame);
  settle(false);
}

void SessionRig::send(std::size_t number, proto::Channel channel, Input bytes) {
  Client& client = *clients_[number];
  const bool on_data = channel == proto::Channel::data;
  Line* line = on_data ? client.data.get() : client.request.get();
  if (line == nullptr || !line->is_open()) return;
  proto::FrameReader& reader = on_data ? client.sent_data : client.sent_requests;
  bool& garbage = on_data ? client.data_garbage : client.garbage;
  while (!bytes.empty() && !garbage) {
    Input rest = bytes;
    const auto frame = reader.next(rest);
    const Input piece = bytes.first(bytes.size() - rest.size());
    bytes = rest;
    if (!frame) {
      garbage = true;
      client.model.sent_garbage(channel, frame.error().code);
      line->write(piece);
      break;
    }
    const bool ambiguous = frame.value() && !on_data && client.model.is_ambiguous(*frame.value());
    if (ambiguous) settle(false);
    line->write(piece);
    if (!frame.value()) continue;
    if (on_data) {
      client.model.sent_on_data(*frame.value());
    } else {
      client.model.sent_on_request(*frame.value());
    }
    // So is a session that its data channel ends: over at once, whatever still comes on the other.
    if (ambiguous || (on_data && client.model.must_end())) settle(false);
  }
  line->write(bytes);
  if (on_data && garbage) settle(false);
  flush(client);
}

void SessionRig::flush(Client& client) {
  if (client.request) client.request->flush(client.piece);
  if (client.data) client.data->flush(client.piece);
}

void SessionRig::close(std::size_t number, proto::Channel channel) {
  Client& client = *clients_[number];
  Line* line = channel == proto::Channel::data ? client.data.get() : client.request.get();
  if (line == nullptr || !line->is_open()) return;
  line->close();
  client.model.closed(channel);
  if (channel == proto::Channel::data) turn(kAll);
}

void SessionRig::receive(std::size_t number, proto::Channel channel, std::size_t most) {
  Client& client = *clients_[number];
  Line* line = channel == proto::Channel::data ? client.data.get() : client.request.get();
  if (line != nullptr) line->receive(most);
}

void SessionRig::sync(std::size_t number) {
  Client& client = *clients_[number];
  // Until the server has nothing more for the request channel: what came on the data channel so far was queued later
  // than the frames of the request channel that it belongs to.
  for (int quiet = 0; quiet < 1'000; ++quiet) {
    const bool received = client.request->receive(kAll);
    if (turn(kAll) || received) quiet = 0;
    const auto channel = client.request_channel.lock();
    if (quiet > 0 && (!channel || channel->queued_frames() == 0 || !client.request->is_open())) break;
    check(quiet < 999, "frames wait although the socket would take them");
  }
  while (const auto frame = client.request->next()) client.model.received_on_request(*frame);
  check(!client.request->was_cut(), "the request channel ends in the middle of a frame");
  if (!client.data || !client.request->is_open()) return;
  while (const auto frame = client.data->next()) client.model.received_on_data(*frame);
  check(!client.data->was_cut() || client.model.may_be_cut(), "the data channel ends in the middle of a frame");
}

bool SessionRig::turn(std::size_t most) {
  bool ran = false;
  io_.restart();
  while (most-- > 0 && io_.poll_one() > 0) {
    ran = true;
    check_daemon();
  }
  return ran;
}

void SessionRig::check_daemon() {
  most_slots_ = std::max(most_slots_, dispatcher_.policy().slots.value_or(scheduler::kMaxSlots));
  check(dispatcher_.running() <= most_slots_, "more transfers run than there are slots");
  for (const auto& client : clients_) {
    const auto session = client->session.lock();
    const auto request = client->request_channel.lock();
    const auto data = client->data_channel.lock();
    const std::size_t chunks = limits_.queued_bytes / (proto::kChunkHeaderBytes + 1) + 2;
    check(!data || data->queued_frames() <= limits_.queued_frames + chunks, "too many frames wait for a data channel");
    if (!session || !session->closed()) continue;
    const std::pair at{request ? request->queued_position() : 0, data ? data->queued_position() : 0};
    if (!client->closed_at) client->closed_at = at;
    check(!request || client->closed_at->first == at.first, "something is sent behind the end of a session");
    check(!data || client->closed_at->second == at.second, "data is sent behind the end of a session");
  }
}

void SessionRig::switch_to(scheduler::Policy policy) {
  dispatcher_.switch_to(std::move(policy));
  check_daemon();
}

void SessionRig::look(std::size_t number) {
  dispatcher_.heard(clients_[number]->key);
  check_daemon();
}

void SessionRig::retired(store::MeshId mesh) {
  for (const auto& client : clients_) {
    if (const auto session = client->session.lock()) session->mesh_retired(mesh, limits_.grace);
  }
}

void SessionRig::drain() {
  settle(false);
  context_.draining = true;
  dispatcher_.drain();
  for (const auto& client : clients_) {
    client->model.server_drains();
    if (const auto session = client->session.lock()) session->server_drains(limits_.drain);
  }
}

bool SessionRig::round() {
  bool moved = turn(kAll);
  for (std::size_t i = 0; i < clients_.size(); ++i) {
    Client& client = *clients_[i];
    moved |= client.request->flush(client.piece);
    moved |= client.data && client.data->flush(client.piece);
    moved |= client.request->receive(kAll);
    moved |= client.data && client.data->receive(kAll);
    sync(i);
    look(i);
  }
  return turn(kAll) || moved;
}

void SessionRig::settle(bool release) {
  // Twice nothing: what the kernel made ready in the last round is seen in the next.
  for (int quiet = 0; quiet < 2;) {
    source_.answer_lookups();
    if (release) source_.answer_all();
    quiet = round() ? 0 : quiet + 1;
  }
  for (const auto& client : clients_) {
    const auto session = client->session.lock();
    const bool closed = !session || session->closed();
    const bool heard = client->request->all_written() && (!client->data || client->data->all_written());
    client->model.settled(closed, heard, release && !context_.draining);
  }
  if (!release || context_.draining) return;
  check(dispatcher_.running() == 0, "a slot is held although nothing runs");
  check(dispatcher_.waiting() == 0, "a request waits although slots are free");
}

void SessionRig::finish() {
  for (const auto& client : clients_) {
    client->request->close();
    if (client->data) client->data->close();
  }
  source_.answer_all();
  dispatcher_.drain();
  while (turn(kAll)) source_.answer_all();
  check(dispatcher_.running() == 0 && dispatcher_.waiting() == 0, "requests are left of sessions that are gone");
  check(tokens_.waiting() == 0, "a token is left of a session that is gone");
  for (const auto& client : clients_) {
    check(client->session.expired(), "a session is left behind");
    check(client->request_channel.expired() && client->data_channel.expired(), "a channel is left behind");
  }
  check(tasks_.running() == 0, "a coroutine is left behind");
}

}  // namespace pmcd::fuzz
