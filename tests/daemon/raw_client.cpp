// SPDX-License-Identifier: MIT
#include "tests/daemon/raw_client.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>

namespace pmcd::test {
namespace {

using std::chrono::milliseconds;
using std::chrono::steady_clock;

/// Whether the descriptor can be read before `deadline`.
bool wait_readable(int fd, steady_clock::time_point deadline) {
  while (true) {
    const auto left = std::chrono::ceil<milliseconds>(deadline - steady_clock::now());
    pollfd poll_on{fd, POLLIN, 0};
    const int ready = ::poll(&poll_on, 1, static_cast<int>(std::max<std::int64_t>(0, left.count())));
    if (ready > 0) return true;
    if (ready == 0) return false;
    if (errno != EINTR) return true;
  }
}

}  // namespace

RawConnection::RawConnection(RawConnection&& other) noexcept {
  *this = std::move(other);
}

RawConnection& RawConnection::operator=(RawConnection&& other) noexcept {
  std::swap(fd_, other.fd_);
  std::swap(frames_, other.frames_);
  std::swap(buffer_, other.buffer_);
  std::swap(input_, other.input_);
  std::swap(pause_, other.pause_);
  return *this;
}

RawConnection RawConnection::tcp(std::uint16_t port, int receive_buffer) {
  const int fd = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  if (receive_buffer > 0) ::setsockopt(fd, SOL_SOCKET, SO_RCVBUF, &receive_buffer, sizeof receive_buffer);
  // A cancel that waits for the acknowledgement of its request comes too late on a fast machine.
  const int on = 1;
  ::setsockopt(fd, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(port);
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  RawConnection connection(fd);
  if (::connect(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
    ADD_FAILURE() << "connect to port " << port << ": " << std::strerror(errno);
    connection.close();
  }
  return connection;
}

RawConnection RawConnection::local(const std::string& path) {
  const int fd = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::strncpy(address.sun_path, path.c_str(), sizeof address.sun_path - 1);
  RawConnection connection(fd);
  // No test failure: a daemon that is killed at random may be gone already.
  if (::connect(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) connection.close();
  return connection;
}

bool RawConnection::send(proto::ByteView bytes) {
  while (!bytes.empty()) {
    const ssize_t sent = ::send(fd_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
    if (sent < 0 && errno == EINTR) continue;
    if (sent <= 0) return false;
    bytes = bytes.subspan(static_cast<std::size_t>(sent));
  }
  return true;
}

std::optional<RawFrame> RawConnection::read(milliseconds patience) {
  const auto deadline = steady_clock::now() + patience;
  while (fd_ >= 0) {
    if (!input_.empty()) {
      auto next = frames_.next(input_);
      if (!next) {
        ADD_FAILURE() << "the daemon sent what is no frame: " << next.error().detail;
        return std::nullopt;
      }
      const auto frame = next.value();
      if (frame) return RawFrame{frame->type, proto::Bytes(frame->body.begin(), frame->body.end())};
      continue;
    }
    if (pause_.count() > 0) std::this_thread::sleep_for(pause_);
    if (!wait_readable(fd_, deadline)) {
      ADD_FAILURE() << "nothing came for " << patience.count() << " ms";
      return std::nullopt;
    }
    buffer_.resize(65536);
    const ssize_t count = ::recv(fd_, buffer_.data(), buffer_.size(), 0);
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) return std::nullopt;
    input_ = proto::ByteView(buffer_).first(static_cast<std::size_t>(count));
  }
  return std::nullopt;
}

bool RawConnection::closes(milliseconds patience) {
  const auto deadline = steady_clock::now() + patience;
  while (wait_readable(fd_, deadline)) {
    buffer_.resize(65536);
    const ssize_t count = ::recv(fd_, buffer_.data(), buffer_.size(), 0);
    if (count == 0 || (count < 0 && errno != EINTR)) return true;
  }
  return false;
}

bool RawConnection::stirs(milliseconds time) {
  return !input_.empty() || wait_readable(fd_, steady_clock::now() + time);
}

void RawConnection::close() {
  if (fd_ >= 0) ::close(fd_);
  fd_ = -1;
}

std::string expect_error(RawConnection& connection, std::optional<std::uint32_t> id) {
  const auto message = expect<proto::ErrorMessage>(connection);
  if (id) {
    EXPECT_EQ(message.id, *id);
  }
  EXPECT_FALSE(message.text.empty());
  return std::string(proto::code_name(message.code));
}

proto::Notice expect_notice(RawConnection& connection, proto::NoticeKind kind) {
  auto notice = expect<proto::Notice>(connection);
  EXPECT_EQ(notice.kind, kind);
  EXPECT_FALSE(notice.text.empty());
  return notice;
}

RawSession RawSession::open(std::uint16_t request_port, int receive_buffer, int request_buffer) {
  RawSession session;
  session.requests = RawConnection::tcp(request_port, request_buffer);
  session.requests.send(proto::encode(proto::Hello{{}, "raw client"}));
  const auto hello = expect<proto::HelloOk>(session.requests);
  session.data = RawConnection::tcp(hello.data_port, receive_buffer);
  session.data.send(proto::encode(proto::Join{{}, hello.token}));
  expect<proto::JoinOk>(session.data);
  return session;
}

RawTransfer RawSession::next_transfer() {
  while (true) {
    const auto frame = data.read();
    if (!frame) {
      ADD_FAILURE() << "the data channel ended within a transfer";
      return {};
    }
    if (frame->is(proto::FrameType::transfer_end)) {
      const auto end = proto::decode<proto::TransferEnd>(frame->body);
      if (!end) {
        ADD_FAILURE() << end.error().detail;
        return {};
      }
      RawTransfer transfer = std::move(under_way_[end.value().id]);
      under_way_.erase(end.value().id);
      transfer.id = end.value().id;
      transfer.result = end.value().result;
      return transfer;
    }
    const auto chunk = proto::decode_chunk(frame->body);
    if (!frame->is(proto::FrameType::chunk) || !chunk) {
      ADD_FAILURE() << "expected a chunk, got type " << frame->type;
      return {};
    }
    const proto::ChunkHeader& header = chunk.value().header;
    RawTransfer& transfer = under_way_[header.id];
    EXPECT_EQ(header.offset, transfer.bytes.size());
    if (transfer.chunks++ > 0) {
      EXPECT_EQ(header.handle, transfer.handle);
      EXPECT_EQ(header.packet, transfer.packet);
    }
    transfer.handle = header.handle;
    transfer.packet = header.packet;
    transfer.bytes.insert(transfer.bytes.end(), chunk.value().bytes.begin(), chunk.value().bytes.end());
    EXPECT_LE(transfer.bytes.size(), header.total);
  }
}

proto::MeshOpened RawSession::open_mesh(std::uint32_t id, const std::string& name) {
  requests.send(proto::encode(proto::GetBaseMesh{id, name}));
  auto opened = expect<proto::MeshOpened>(requests);
  EXPECT_EQ(opened.id, id);
  return opened;
}

std::vector<proto::Bytes> RawSession::fetch(const std::string& name) {
  std::vector<proto::Bytes> packets;
  std::uint32_t id = 1'000;
  const auto opened = open_mesh(id, name);
  while (true) {
    RawTransfer transfer = next_transfer();
    EXPECT_EQ(transfer.id, id);
    if (transfer.result != proto::TransferResult::complete) {
      EXPECT_STREQ(proto::result_name(transfer.result), "end_of_mesh");
      EXPECT_EQ(transfer.chunks, 0U);
      return packets;
    }
    EXPECT_EQ(transfer.handle, opened.handle);
    EXPECT_EQ(transfer.packet, packets.size());
    packets.push_back(std::move(transfer.bytes));
    requests.send(proto::encode(proto::GetNextPacket{++id, opened.handle}));
  }
}

RawAdmin RawAdmin::open(const std::string& path) {
  RawAdmin admin{RawConnection::local(path)};
  if (admin.connection.fd() < 0) return admin;
  admin.connection.send(proto::encode(proto::AdminHello{{}, "raw admin"}));
  const auto frame = admin.connection.read();
  if (!frame || !frame->is(proto::FrameType::admin_hello_ok)) admin.connection.close();
  return admin;
}

std::string RawAdmin::answer(const proto::Bytes& request) {
  connection.send(request);
  return read_answer();
}

std::string RawAdmin::read_answer() {
  std::string text;
  while (true) {
    const auto frame = connection.read();
    if (!frame) return "lost";
    if (frame->is(proto::FrameType::error)) {
      const auto error = proto::decode<proto::ErrorMessage>(frame->body);
      return error ? "error: " + std::string(proto::code_name(error.value().code)) : "an error that is none";
    }
    const auto piece = proto::decode<proto::AdminAnswer>(frame->body);
    if (!piece) return piece.error().detail;
    text += piece.value().text;
    if (piece.value().last) return text;
  }
}

std::string RawAdmin::ingest(const std::string& name, const FakeMesh& mesh, bool replace, std::size_t piece) {
  const auto reply = [this](proto::FrameType wanted, bool& replaced) -> std::string {
    const auto frame = connection.read();
    if (!frame) return "lost";
    if (frame->is(proto::FrameType::error)) {
      const auto error = proto::decode<proto::ErrorMessage>(frame->body);
      return error ? std::string(proto::code_name(error.value().code)) : "an error that is none";
    }
    if (!frame->is(wanted)) return "type " + std::to_string(frame->type);
    if (frame->is(proto::FrameType::ingest_ok)) {
      const auto done = proto::decode<proto::IngestOk>(frame->body);
      replaced = done.ok() && done.value().replaced;
    }
    return "ok";
  };
  bool replaced = false;
  if (!connection.send(proto::encode(proto::IngestBegin{7, replace, name, mesh.directory_bytes()}))) return "lost";
  if (std::string begun = reply(proto::FrameType::ingest_ready, replaced); begun != "ok") return begun;
  for (std::uint32_t packet = 0; packet < mesh.packets.size(); ++packet) {
    const proto::ByteView bytes = mesh.packets[packet];
    for (std::size_t at = 0; at < bytes.size(); at += piece) {
      const proto::ByteView part = bytes.subspan(at, std::min(piece, bytes.size() - at));
      const auto head = proto::encode_ingest_data_header({7, packet, at}, static_cast<std::uint32_t>(part.size()));
      if (!connection.send(head) || !connection.send(part)) return "lost";
    }
  }
  if (!connection.send(proto::encode(proto::IngestCommit{7}))) return "lost";
  std::string end = reply(proto::FrameType::ingest_ok, replaced);
  return end == "ok" && replaced ? "replaced" : end;
}

}  // namespace pmcd::test
