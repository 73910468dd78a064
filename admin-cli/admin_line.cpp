// SPDX-License-Identifier: GPL-3.0-or-later
// Plain blocking socket calls with poll before each, so that nothing waits for ever.
#include "admin-cli/admin_line.h"

#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>

namespace pmcd::admin {

namespace {

using std::chrono::milliseconds;
using std::chrono::steady_clock;

constexpr milliseconds kHelloPatience{10'000};
constexpr milliseconds kSendPatience{60'000};

/// Waits for `events`; false when the time is over.
bool wait_for(int fd, short events, milliseconds patience) {
  const auto until = steady_clock::now() + patience;
  for (;;) {
    const auto left = std::chrono::duration_cast<milliseconds>(until - steady_clock::now());
    pollfd what{fd, events, 0};
    const int ready = ::poll(&what, 1, static_cast<int>(std::max<milliseconds::rep>(left.count(), 0)));
    if (ready > 0) return true;
    if (ready == 0 || errno != EINTR) return false;
  }
}

Failure cannot_connect(const std::string& path, int error) {
  std::string text = "no daemon answers on " + path + ": ";
  if (error == ENOENT || error == ECONNREFUSED) {
    text += "is pmcd running? (--socket names another socket)";
  } else if (error == EACCES) {
    text = "this user may not open " + path + ": run as root or as a member of the socket's group";
  } else {
    text += std::strerror(error);
  }
  return {kRefused, proto::ErrorCode::none, text};
}

}  // namespace

AdminLine::AdminLine(AdminLine&& other) noexcept {
  *this = std::move(other);
}

AdminLine& AdminLine::operator=(AdminLine&& other) noexcept {
  if (this == &other) return *this;
  if (fd_ >= 0) ::close(fd_);
  fd_ = std::exchange(other.fd_, -1);
  path_ = std::move(other.path_);
  reader_ = std::move(other.reader_);
  received_ = std::move(other.received_);
  input_ = std::exchange(other.input_, {});
  return *this;
}

AdminLine::~AdminLine() {
  if (fd_ >= 0) ::close(fd_);
}

Failure AdminLine::lost(const std::string& why) const {
  return {kRefused, proto::ErrorCode::none, "the daemon on " + path_ + " " + why + "; its log says more"};
}

std::variant<AdminLine, Failure> AdminLine::open(const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.empty() || path.size() >= sizeof address.sun_path) {
    return Failure{kUsage, proto::ErrorCode::none, "\"" + path + "\" is too long or too short for a socket's path"};
  }
  std::copy(path.begin(), path.end(), address.sun_path);
  const int fd = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
  if (fd < 0) return cannot_connect(path, errno);
  AdminLine line(fd, path);
  if (::connect(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
    return cannot_connect(path, errno);
  }
  if (auto failed = line.send(proto::encode(proto::AdminHello{{}, "pmcctl"}))) return *failed;
  auto answer = line.receive(kHelloPatience);
  if (auto* failed = std::get_if<Failure>(&answer)) return std::move(*failed);
  auto hello = read_as<proto::AdminHelloOk>(std::get<Answer>(answer));
  if (auto* failed = std::get_if<Failure>(&hello)) return std::move(*failed);
  return line;
}

std::optional<Failure> AdminLine::send(proto::ByteView bytes) {
  while (!bytes.empty()) {
    if (!wait_for(fd_, POLLOUT, kSendPatience)) return lost("takes nothing any more");
    const ssize_t sent = ::send(fd_, bytes.data(), bytes.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
    if (sent < 0 && (errno == EINTR || errno == EAGAIN)) continue;
    // A daemon that closes may have said why: let receive() find it.
    if (sent < 0) return has_news() ? std::nullopt : std::optional(lost("closed the connection"));
    bytes = bytes.subspan(static_cast<std::size_t>(sent));
  }
  return std::nullopt;
}

bool AdminLine::has_news() const {
  pollfd what{fd_, POLLIN, 0};
  return !input_.empty() || ::poll(&what, 1, 0) == 1;
}

std::variant<Answer, Failure> AdminLine::receive(milliseconds patience) {
  const auto until = steady_clock::now() + patience;
  for (;;) {
    if (input_.empty()) {
      const auto left = std::chrono::duration_cast<milliseconds>(until - steady_clock::now());
      if (!wait_for(fd_, POLLIN, left)) return lost("does not answer");
      received_.resize(64 * 1024);
      const ssize_t size = ::recv(fd_, received_.data(), received_.size(), 0);
      if (size < 0 && errno == EINTR) continue;
      if (size <= 0) return lost("closed the connection");
      input_ = proto::ByteView(received_).first(static_cast<std::size_t>(size));
    }
    const auto frame = reader_.next(input_);
    if (!frame) return lost("does not speak pmcd's admin protocol: " + frame.error().detail);
    if (!*frame) continue;
    const Answer answer{(*frame)->type, {(*frame)->body.begin(), (*frame)->body.end()}};
    if (answer.type != static_cast<std::uint16_t>(proto::FrameType::error)) return answer;
    const auto error = proto::decode<proto::ErrorMessage>(answer.body);
    if (!error) return lost("sent an error that cannot be read");
    const proto::CodeInfo* info = proto::find_code(static_cast<std::uint16_t>(error->code));
    std::string text = error->text;
    if (text.empty()) text = info == nullptr ? "the daemon did not say why" : std::string(info->sentence);
    return Failure{kRefused, error->code, text + " [" + std::string(proto::code_name(error->code)) + "]"};
  }
}

}  // namespace pmcd::admin
