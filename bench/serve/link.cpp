// SPDX-License-Identifier: MIT
// Sockets and frames for the loads. Connecting blocks: on loopback the kernel completes it within the call.
#include "bench/serve/link.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <utility>

namespace pmcd::bench {
namespace {

constexpr std::size_t kSources = 200;  ///< 127.0.0.1 to 127.0.0.200
constexpr int kPatienceSeconds = 10;

sockaddr_in loopback(std::size_t host, std::uint16_t port) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(port);
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK - 1 + static_cast<std::uint32_t>(host));
  return address;
}

void set_option(int fd, int level, int name, int value) {
  if (::setsockopt(fd, level, name, &value, sizeof value) != 0)
    fail(std::string("setsockopt: ") + std::strerror(errno));
}

}  // namespace

void fail(const std::string& text) {
  std::fprintf(stderr, "%s: %s\n", program_invocation_short_name, text.c_str());
  std::exit(1);
}

Socket& Socket::operator=(Socket&& other) noexcept {
  if (this != &other) {
    close();
    fd_ = other.release();
  }
  return *this;
}

Socket Socket::connect(std::uint16_t port, std::size_t source) {
  const int fd = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  if (fd < 0) fail(std::string("socket: ") + std::strerror(errno));
  Socket socket(fd);
  set_option(fd, IPPROTO_TCP, TCP_NODELAY, 1);
  // The port is chosen by connect(), which may take one that another connection of ours has to another port.
  set_option(fd, IPPROTO_IP, IP_BIND_ADDRESS_NO_PORT, 1);
  const timeval patience{kPatienceSeconds, 0};
  ::setsockopt(fd, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
  const sockaddr_in from = loopback(1 + source % kSources, 0);
  const sockaddr_in to = loopback(1, port);
  if (::bind(fd, reinterpret_cast<const sockaddr*>(&from), sizeof from) != 0 ||
      ::connect(fd, reinterpret_cast<const sockaddr*>(&to), sizeof to) != 0) {
    fail("connect to port " + std::to_string(port) + ": " + std::strerror(errno));
  }
  return socket;
}

void Socket::send(proto::ByteView bytes) const {
  const ssize_t sent = ::send(fd_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
  if (sent != static_cast<ssize_t>(bytes.size())) {
    fail(std::string("send: ") + (sent < 0 ? std::strerror(errno) : "the socket takes no more"));
  }
}

std::optional<std::size_t> Socket::receive(std::vector<std::byte>& into) const {
  while (true) {
    const ssize_t count = ::recv(fd_, into.data(), into.size(), 0);
    if (count >= 0) return static_cast<std::size_t>(count);
    if (errno == EAGAIN || errno == EWOULDBLOCK) return std::nullopt;
    if (errno == ECONNRESET) return 0;
    if (errno != EINTR) fail(std::string("recv: ") + std::strerror(errno));
  }
}

void Socket::set_non_blocking() const {
  if (::fcntl(fd_, F_SETFL, O_NONBLOCK) != 0) fail(std::string("fcntl: ") + std::strerror(errno));
}

void Socket::close() {
  if (fd_ >= 0) ::close(std::exchange(fd_, -1));
}

int Socket::release() {
  return std::exchange(fd_, -1);
}

std::optional<proto::Frame> Link::next(std::vector<std::byte>& buffer) {
  while (!at_end_) {
    if (taken_ < pending_.size()) {
      proto::ByteView input = proto::ByteView(pending_).subspan(taken_);
      auto frame = frames_.next(input);
      if (!frame) fail("the daemon sent what is no frame: " + frame.error().detail);
      taken_ = pending_.size() - input.size();
      if (frame.value()) return frame.value();
    }
    const auto count = socket_.receive(buffer);
    if (!count) return std::nullopt;
    at_end_ = *count == 0;
    pending_.assign(buffer.begin(), buffer.begin() + static_cast<std::ptrdiff_t>(*count));
    taken_ = 0;
  }
  return std::nullopt;
}

std::string describe(const std::optional<proto::Frame>& frame) {
  if (!frame) return "nothing";
  if (frame->type == static_cast<std::uint16_t>(proto::FrameType::error)) {
    const auto error = proto::decode<proto::ErrorMessage>(frame->body);
    if (error) return "error " + std::string(proto::code_name(error.value().code)) + ": " + error.value().text;
  }
  const char* const name = proto::type_name(frame->type);
  return name != nullptr ? name : "a frame of type " + std::to_string(frame->type);
}

proto::Bytes hello_frame() {
  proto::Hello hello;
  hello.agent = "serve_load";
  return proto::encode(hello);
}

proto::Bytes join_frame(const proto::Token& token) {
  proto::Join join;
  join.token = token;
  return proto::encode(join);
}

OpenSession open_session(std::uint16_t request_port, std::size_t source) {
  std::vector<std::byte> buffer(1024);
  OpenSession session;
  session.requests = Link(Socket::connect(request_port, source));
  session.requests.socket().send(hello_frame());
  const auto hello = expect<proto::HelloOk>(session.requests.next(buffer));
  session.data = Link(Socket::connect(hello.data_port, source));
  session.data.socket().send(join_frame(hello.token));
  expect<proto::JoinOk>(session.data.next(buffer));
  return session;
}

}  // namespace pmcd::bench
