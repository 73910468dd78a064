// SPDX-License-Identifier: MIT
// The scripted server: plain blocking sockets with time-outs.
#include "tests/client/mock_server.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <span>
#include <utility>

namespace pmcd::client::testing {

namespace {

constexpr int kPatienceMs = 5000;

void must(bool good, const char* what) {
  if (!good) throw std::runtime_error(std::string("mock server: ") + what + ": " + std::strerror(errno));
}

bool readable(int fd, int milliseconds) {
  pollfd poll_fd{fd, POLLIN, 0};
  return ::poll(&poll_fd, 1, milliseconds) == 1;
}

void wait_readable(int fd) {
  if (!readable(fd, kPatienceMs)) throw std::runtime_error("mock server: the client did not come");
}

}  // namespace

Socket& Socket::operator=(Socket&& other) noexcept {
  if (this != &other) {
    close();
    fd_ = std::exchange(other.fd_, -1);
  }
  return *this;
}

Socket Socket::listen() {
  Socket socket(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0));
  must(socket.fd_ >= 0, "socket");
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  must(::bind(socket.fd_, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0, "bind");
  must(::listen(socket.fd_, 8) == 0, "listen");
  return socket;
}

std::uint16_t Socket::port() const {
  sockaddr_in address{};
  socklen_t size = sizeof address;
  must(::getsockname(fd_, reinterpret_cast<sockaddr*>(&address), &size) == 0, "getsockname");
  return ntohs(address.sin_port);
}

Socket Socket::accept() const {
  wait_readable(fd_);
  Socket socket(::accept4(fd_, nullptr, nullptr, SOCK_CLOEXEC));
  must(socket.fd_ >= 0, "accept");
  return socket;
}

void Socket::send(proto::ByteView bytes) const {
  while (!bytes.empty()) {
    const ssize_t sent = ::send(fd_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
    must(sent > 0, "send");
    bytes = bytes.subspan(static_cast<std::size_t>(sent));
  }
}

bool Socket::readable_within(std::chrono::milliseconds time) const {
  return readable(fd_, static_cast<int>(time.count()));
}

proto::Bytes Socket::receive() const {
  wait_readable(fd_);
  proto::Bytes bytes(4096);
  const ssize_t size = ::recv(fd_, bytes.data(), bytes.size(), 0);
  bytes.resize(size > 0 ? static_cast<std::size_t>(size) : 0);
  return bytes;
}

void Socket::close() {
  if (fd_ >= 0) ::close(fd_);
  fd_ = -1;
}

void Line::send_chunk(const proto::ChunkHeader& header, proto::ByteView bytes) {
  socket_.send(proto::encode_chunk_header(header, static_cast<std::uint32_t>(bytes.size())));
  socket_.send(bytes);
}

proto::Frame Line::next() {
  for (;;) {
    if (input_.empty()) {
      received_ = socket_.receive();
      if (received_.empty()) throw std::runtime_error("mock server: the client closed the connection");
      input_ = received_;
    }
    const auto frame = reader_.next(input_);
    if (!frame) throw std::runtime_error("mock server: no frame: " + frame.error().detail);
    if (*frame) return **frame;
  }
}

bool Line::speaks_within(std::chrono::milliseconds time) {
  return !input_.empty() || socket_.readable_within(time);
}

bool Line::closed() {
  return input_.empty() && socket_.receive().empty();
}

MockMesh mock_mesh(const std::vector<std::size_t>& payload_bytes) {
  MockMesh mesh;
  codec::Directory directory;
  directory.generation = mesh.generation;
  directory.lossless = true;
  directory.lattice.step = 0.5;
  directory.box_max = {1, 1, 1};
  for (std::size_t i = 0; i < payload_bytes.size(); ++i) {
    proto::Bytes payload(payload_bytes[i]);
    for (std::size_t b = 0; b < payload.size(); ++b) payload[b] = static_cast<std::byte>(b + i);
    codec::PacketHeader header;
    header.last = i + 1 == payload_bytes.size();
    header.level = static_cast<std::uint32_t>(i);
    header.vertices = static_cast<std::uint32_t>(10 * (i + 1));
    header.faces = static_cast<std::uint32_t>(20 * (i + 1));
    header.generation = mesh.generation;
    proto::Bytes packet = codec::make_packet(header, payload);
    const auto written = codec::check_packet(packet);
    if (!written) throw std::runtime_error("mock packet: " + written.error().detail);
    directory.levels.push_back({static_cast<std::uint32_t>(packet.size()), header.vertices, header.faces,
                                static_cast<std::uint8_t>(directory.lattice.bits), written->crc32c, -1, -1});
    mesh.packets.push_back(std::move(packet));
  }
  mesh.directory = codec::serialize(directory);
  return mesh;
}

MockServer::MockServer(Script script)
    : thread_([this, script = std::move(script)] {
        try {
          script(*this);
        } catch (const std::exception& error) {
          thrown_ = error.what();
        }
      }) {}

std::string MockServer::finish() {
  if (thread_.joinable()) thread_.join();
  return thrown_;
}

MockServer::Peer MockServer::accept_session(std::uint8_t max_open_requests) {
  Line request = accept_request();
  request.expect<proto::Hello>();
  proto::HelloOk ok;
  ok.token.fill(std::byte{7});
  ok.data_port = data_port_;
  ok.max_open_requests = max_open_requests;
  ok.agent = "mock";
  request.send(ok);
  Line data = accept_data();
  if (data.expect<proto::Join>().token != ok.token) throw std::runtime_error("the client joined with another token");
  data.send(proto::JoinOk{});
  return {std::move(request), std::move(data)};
}

void MockServer::send_part(Peer& peer, std::uint32_t id, const MockMesh& mesh, std::uint32_t number, std::size_t from,
                           std::size_t to, std::uint32_t handle) {
  const proto::ByteView packet = mesh.packets.at(number);
  for (std::size_t at = from; at < to; at += 100) {
    peer.data.send_chunk({id, handle, number, at, packet.size()},
                         packet.subspan(at, std::min<std::size_t>(100, to - at)));
  }
}

void MockServer::send_packet(Peer& peer, std::uint32_t id, const MockMesh& mesh, std::uint32_t number,
                             std::uint32_t handle, std::size_t from) {
  send_part(peer, id, mesh, number, from, mesh.packets.at(number).size(), handle);
  peer.data.send(proto::TransferEnd{id, proto::TransferResult::complete, proto::ErrorCode::none});
}

std::uint32_t MockServer::expect_get_packet(Peer& peer, const MockMesh& mesh, std::uint32_t number,
                                            std::uint64_t offset) {
  const auto request = peer.request.expect<proto::GetPacket>();
  if (request != proto::GetPacket{request.id, mesh.generation, number, offset}) {
    throw std::runtime_error("the client asked for packet " + std::to_string(request.packet) + " from byte " +
                             std::to_string(request.offset) + ", expected was packet " + std::to_string(number) +
                             " from byte " + std::to_string(offset));
  }
  return request.id;
}

void MockServer::serve_rest(Peer& peer, const MockMesh& mesh, std::uint32_t number, std::uint64_t offset, bool opens,
                            std::uint32_t handle) {
  const std::uint32_t id = expect_get_packet(peer, mesh, number, offset);
  if (opens) peer.request.send(proto::MeshOpened{id, handle, mesh.generation, mesh.directory});
  send_packet(peer, id, mesh, number, handle, static_cast<std::size_t>(offset));
}

std::uint32_t MockServer::serve_base(Peer& peer, const MockMesh& mesh, std::uint32_t handle) {
  const std::uint32_t id = peer.request.expect<proto::GetBaseMesh>().id;
  peer.request.send(proto::MeshOpened{id, handle, mesh.generation, mesh.directory});
  send_packet(peer, id, mesh, 0, handle);
  return id;
}

void MockServer::serve_next(Peer& peer, const MockMesh& mesh, std::uint32_t number, std::uint32_t handle) {
  const auto request = peer.request.expect<proto::GetNextPacket>();
  if (request.handle != handle)
    throw std::runtime_error("the client asked for handle " + std::to_string(request.handle));
  send_packet(peer, request.id, mesh, number, handle);
}

Options quick() {
  Options options;
  options.connect_timeout = std::chrono::seconds(3);
  options.silence_timeout = std::chrono::seconds(3);
  options.progress_timeout = std::chrono::seconds(3);
  return options;
}

Error first_error(MockServer& server, const Options& options) {
  auto session = Session::connect(server.address(), options);
  if (!session) return session.error();
  const auto mesh = session->open("m");
  if (!mesh) return mesh.error();
  for (;;) {
    const auto packet = session->next_packet(mesh->handle);
    if (!packet) return packet.error();
    if (!*packet) return {Failure::violation, proto::ErrorCode::none, "no error"};
  }
}

}  // namespace pmcd::client::testing
