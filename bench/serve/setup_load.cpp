// SPDX-License-Identifier: MIT
// The load for session set-up: a number of sessions at a time, each from its first connection to the daemon's closing
// of both channels, and then the next in its place.
#include <sys/epoll.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <memory>
#include <string>
#include <utility>

#include "bench/serve/figures.h"
#include "bench/serve/link.h"
#include "bench/serve/loads.h"

namespace pmcd::bench {
namespace {

/// Runs through sessions, one after the other.
class Visitor {
 public:
  Visitor(std::uint16_t port, int events, std::size_t number) : port_(port), events_(events), number_(number) {}

  void begin() {
    began_ = Clock::now();
    requests_ = connect(port_, 2 * number_);
    requests_.socket().send(hello_frame());
    step_ = Step::greeting;
  }

  /// Something came on the request channel (or the data channel). True when the session is over.
  bool on_readable(bool data_channel, std::vector<std::byte>& buffer) {
    Link& link = data_channel ? data_ : requests_;
    if (link.socket().fd() < 0) return false;  // closed earlier in this round of events
    while (const auto frame = link.next(buffer)) {
      if (step_ == Step::greeting && !data_channel) {
        const auto hello = expect<proto::HelloOk>(frame);
        data_ = connect(hello.data_port, 2 * number_ + 1);
        data_.socket().send(join_frame(hello.token));
        step_ = Step::joining;
      } else if (step_ == Step::joining && data_channel) {
        expect<proto::JoinOk>(frame);
        set_up_us_ = std::chrono::duration<float, std::micro>(Clock::now() - began_).count();
        requests_.socket().send(proto::encode(proto::Goodbye{}));
        step_ = Step::leaving;
      } else {
        fail("during set-up came " + describe(frame));
      }
    }
    if (!link.at_end()) return false;
    if (step_ != Step::leaving) fail("the daemon closed a session that was being set up");
    link.socket().close();
    return requests_.socket().fd() < 0 && data_.socket().fd() < 0;
  }

  /// From the first connect to join_ok, of the session that is over.
  [[nodiscard]] float set_up_us() const { return set_up_us_; }

 private:
  enum class Step { greeting, joining, leaving };

  Link connect(std::uint16_t port, std::uint64_t key) const {
    Socket socket = Socket::connect(port, number_);
    socket.set_non_blocking();
    epoll_event event{};
    event.events = EPOLLIN;
    event.data.u64 = key;
    if (::epoll_ctl(events_, EPOLL_CTL_ADD, socket.fd(), &event) != 0) {
      fail(std::string("epoll_ctl: ") + std::strerror(errno));
    }
    return Link(std::move(socket));
  }

  std::uint16_t port_;
  int events_;
  std::size_t number_;
  Step step_ = Step::greeting;
  Clock::time_point began_;
  float set_up_us_ = 0;
  Link requests_;
  Link data_;
};

}  // namespace

nlohmann::json setup_load(const SetupOptions& options) {
  const Socket events(::epoll_create1(EPOLL_CLOEXEC));
  std::vector<Visitor> visitors;
  for (std::size_t number = 0; number < options.at_once; ++number)
    visitors.emplace_back(options.port, events.fd(), number);
  std::vector<float> set_up_us;
  std::vector<std::byte> buffer(4096);
  std::array<epoll_event, 256> ready{};
  const double cpu_before = seconds_of_cpu();
  const Clock::time_point start = Clock::now();
  const auto length = std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(options.seconds));
  for (Visitor& visitor : visitors) visitor.begin();
  while (Clock::now() - start < length) {
    const int count = ::epoll_wait(events.fd(), ready.data(), static_cast<int>(ready.size()), 1000);
    if (count < 0 && errno != EINTR) fail(std::string("epoll_wait: ") + std::strerror(errno));
    for (int i = 0; i < count; ++i) {
      const std::uint64_t key = ready[static_cast<std::size_t>(i)].data.u64;
      Visitor& visitor = visitors[key / 2];
      if (!visitor.on_readable(key % 2 == 1, buffer)) continue;
      set_up_us.push_back(visitor.set_up_us());
      visitor.begin();
    }
  }
  const double seconds = std::chrono::duration<double>(Clock::now() - start).count();
  const double cpu = seconds_of_cpu() - cpu_before;
  return {{"seconds", seconds},
          {"sessions", set_up_us.size()},
          {"cpu_seconds", cpu},
          {"latency_us", percentiles(set_up_us)}};
}

}  // namespace pmcd::bench
