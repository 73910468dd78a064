// SPDX-License-Identifier: MIT
#include "bench/rules/fetch_client.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/signalfd.h>
#include <sys/socket.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <thread>
#include <utility>
#include <vector>

#include "bench/serve/data_stream.h"
#include "bench/serve/link.h"
#include "codec/packet/directory.h"
#include "codec/packet/header.h"

namespace pmcd::bench {
namespace {

constexpr std::size_t kReceiveBuffer = 256 * 1024;
/// Of a client that will stall: the kernel would take the whole mesh for it otherwise, and nobody would see it stall.
constexpr int kStallingBuffer = 16 * 1024;
constexpr timeval kPatience{60, 0};

/// The session ended otherwise than by complete packets.
struct Ended {
  std::string how;
  std::string why;
};

Socket connect_to(const std::string& address, std::uint16_t port, bool will_stall) {
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_port = htons(port);
  if (::inet_pton(AF_INET, address.c_str(), &to.sin_addr) != 1) fail("\"" + address + "\" is no IPv4 address");
  const int fd = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  if (fd < 0) fail(std::string("socket: ") + std::strerror(errno));
  Socket socket(fd);
  const int on = 1;
  ::setsockopt(fd, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
  ::setsockopt(fd, SOL_SOCKET, SO_RCVTIMEO, &kPatience, sizeof kPatience);
  ::setsockopt(fd, SOL_SOCKET, SO_SNDTIMEO, &kPatience, sizeof kPatience);
  if (will_stall) ::setsockopt(fd, SOL_SOCKET, SO_RCVBUF, &kStallingBuffer, sizeof kStallingBuffer);
  if (::connect(fd, reinterpret_cast<const sockaddr*>(&to), sizeof to) != 0) {
    fail("connect to " + address + " port " + std::to_string(port) + ": " + std::strerror(errno));
  }
  return socket;
}

class Client {
 public:
  explicit Client(const ClientOptions& options) : options_(options), start_(start_time(options)) {
    sigset_t ends;
    sigemptyset(&ends);
    sigaddset(&ends, SIGTERM);
    sigaddset(&ends, SIGINT);
    ::sigprocmask(SIG_BLOCK, &ends, nullptr);
    signals_ = Socket(::signalfd(-1, &ends, SFD_CLOEXEC));
    std::this_thread::sleep_until(start_);
  }

  nlohmann::json run() {
    try {
      open();
      ask();
      while (!complete_) wait();
      report_["ended"] = "complete";
    } catch (const Ended& end) {
      report_["ended"] = end.how;
      report_["why"] = end.why;
      report_["ended_at"] = seconds();
    }
    return report_;
  }

 private:
  static Clock::time_point start_time(const ClientOptions& options) {
    const auto duration = [](double seconds) {
      return std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds));
    };
    const Clock::time_point begin = options.start_at ? Clock::time_point(duration(*options.start_at)) : Clock::now();
    return begin + duration(options.delay_start);
  }

  [[nodiscard]] double seconds() const { return std::chrono::duration<double>(Clock::now() - start_).count(); }

  void open() {
    const bool will_stall = options_.stall_after.has_value();
    requests_ = Link(connect_to(options_.address, options_.port, false));
    report_["connected"] = seconds();
    requests_.socket().send(hello_frame());
    const auto hello = answer<proto::HelloOk>(requests_);
    if (options_.open > hello.max_open_requests) {
      fail("the daemon takes " + std::to_string(hello.max_open_requests) + " open requests at most");
    }
    Link data(connect_to(options_.address, hello.data_port, will_stall));
    data.socket().send(join_frame(hello.token));
    answer<proto::JoinOk>(data);
    report_["joined"] = seconds();
    // Nothing comes behind join_ok before something was asked for.
    data_ = std::move(data.socket());
    data_.set_non_blocking();
    requests_.socket().set_non_blocking();
  }

  template <typename M>
  M answer(Link& link) {
    const auto frame = link.next(buffer_);
    if (!frame) throw Ended{"dropped", link.at_end() ? "closed without a word" : "no answer"};
    throw_error(*frame);
    return expect<M>(frame);
  }

  static void throw_error(const proto::Frame& frame) {
    if (frame.type == static_cast<std::uint16_t>(proto::FrameType::error)) throw Ended{"dropped", describe(frame)};
  }

  /// Keeps as many requests open as wanted, for no more packets than there are.
  void ask() {
    while (asked_ - done_ < options_.open &&
           (directory_ ? asked_ < directory_->levels.size() : asked_ < options_.open)) {
      const auto id = static_cast<std::uint32_t>(++asked_);
      if (id == 1) {
        requests_.socket().send(proto::encode(proto::GetBaseMesh{id, options_.mesh}));
      } else {
        // Handle 0 is the mesh last asked for, so mesh_opened need not be awaited.
        requests_.socket().send(proto::encode(proto::GetNextPacket{id, 0}));
      }
    }
  }

  void wait() {
    std::array<pollfd, 3> fds{pollfd{signals_.fd(), POLLIN, 0}, pollfd{requests_.socket().fd(), POLLIN, 0},
                              pollfd{stalled_ ? -1 : data_.fd(), POLLIN, 0}};
    if (::poll(fds.data(), fds.size(), -1) < 0 && errno != EINTR) fail(std::string("poll: ") + std::strerror(errno));
    if (fds[0].revents != 0) throw Ended{stalled_ ? "stalled" : "interrupted", "it was told to end"};
    if (fds[1].revents != 0) on_requests();
    if (fds[2].revents != 0) on_data();
  }

  void on_requests() {
    while (const auto frame = requests_.next(buffer_)) {
      if (frame->type == static_cast<std::uint16_t>(proto::FrameType::notice)) continue;
      if (stalled_ && frame->type == static_cast<std::uint16_t>(proto::FrameType::error)) {
        throw Ended{"stalled", describe(frame)};
      }
      throw_error(*frame);
      const auto opened = expect<proto::MeshOpened>(frame);
      auto parsed = codec::parse_directory(opened.directory);
      if (!parsed) fail("the directory of " + options_.mesh + ": " + parsed.error().detail);
      directory_ = std::move(parsed.value().directory);
      report_["opened"] = seconds();
      check_waiting();
      ask();
    }
    if (requests_.at_end()) throw Ended{stalled_ ? "stalled" : "dropped", "the request channel was closed"};
  }

  void on_data() {
    const auto count = data_.receive(buffer_);
    if (!count) return;
    // The request channel tells why, if anything does.
    if (*count == 0) {
      while (const auto frame = requests_.next(buffer_)) throw_error(*frame);
      throw Ended{"dropped", "the data channel was closed"};
    }
    const double now = seconds();
    stream_.feed(
        proto::ByteView(buffer_).first(*count),
        [this, now](const proto::ChunkHeader& chunk, proto::ByteView piece) { on_piece(chunk, piece, now); },
        [this](const proto::Frame& frame) { on_frame(frame); });
  }

  void on_piece(const proto::ChunkHeader& chunk, proto::ByteView piece, double now) {
    if (chunk.id != done_ + 1 || chunk.packet != done_ || chunk.offset != packet_.size()) {
      fail("a chunk of request " + std::to_string(chunk.id) + ", packet " + std::to_string(chunk.packet) + " at " +
           std::to_string(chunk.offset) + "; expected was packet " + std::to_string(done_) + " at " +
           std::to_string(packet_.size()));
    }
    packet_.insert(packet_.end(), piece.begin(), piece.end());
    if (packet_.size() == chunk.total) {
      report_["packets"].push_back({{"packet", chunk.packet}, {"bytes", chunk.total}, {"time", now}});
    }
  }

  void on_frame(const proto::Frame& frame) {
    throw_error(frame);
    const auto end = expect<proto::TransferEnd>(frame);
    if (end.id != done_ + 1) fail("request " + std::to_string(end.id) + " ended out of order");
    if (end.result != proto::TransferResult::complete) {
      throw Ended{"dropped", std::string("a transfer ended by ") + proto::result_name(end.result)};
    }
    whole_.push_back(std::exchange(packet_, {}));
    const auto packet = static_cast<std::uint32_t>(done_++);
    check_waiting();
    if (options_.leave_after == packet) {
      requests_.socket().send(proto::encode(proto::Goodbye{}));
      throw Ended{"left", "behind packet " + std::to_string(packet)};
    }
    if (!complete_) ask();
    stalled_ = options_.stall_after == packet;
    if (stalled_) report_["stalled_at"] = seconds();
  }

  /// Checks the packets that are whole, as soon as the directory is there, which may be later than the first of them.
  void check_waiting() {
    if (!directory_) return;
    for (auto& bytes : std::exchange(whole_, {})) {
      const std::size_t packet = checked_++;
      const auto header = codec::check_packet(bytes);
      if (!header) fail("packet " + std::to_string(packet) + ": " + header.error().detail);
      if (header.value().crc32c != directory_->levels.at(packet).crc32c ||
          bytes.size() != directory_->levels.at(packet).bytes) {
        fail("packet " + std::to_string(packet) + " is not the one that the directory announces");
      }
    }
    if (checked_ == directory_->levels.size()) {
      complete_ = true;
      report_["finished"] = report_["packets"].back()["time"];
    }
  }

  const ClientOptions& options_;
  Clock::time_point start_;
  Socket signals_;
  Link requests_;
  Socket data_;
  DataStream stream_;
  std::vector<std::byte> buffer_ = std::vector<std::byte>(kReceiveBuffer);
  std::optional<codec::Directory> directory_;
  std::size_t asked_ = 0;  ///< requests so far; request k + 1 is for packet k
  std::size_t done_ = 0;   ///< packets that came whole
  std::size_t checked_ = 0;
  std::vector<std::byte> packet_;              ///< what has come of the packet under way
  std::vector<std::vector<std::byte>> whole_;  ///< packets that are not checked yet
  bool stalled_ = false;
  bool complete_ = false;
  nlohmann::json report_ = {{"packets", nlohmann::json::array()}};
};

}  // namespace

nlohmann::json fetch_mesh(const ClientOptions& options) {
  return Client(options).run();
}

}  // namespace pmcd::bench
