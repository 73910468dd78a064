// SPDX-License-Identifier: MIT
// rules_relay: a line between two network namespaces, made of two tun devices and this process between them: delay,
// loss, and if wanted rate and queue, which the kernels of many machines lack (netem). Says {"ready":true} when both
// devices are there, and on SIGTERM or SIGINT prints what it forwarded and dropped. It gives the devices neither
// addresses nor routes; they end with it.
#include <fcntl.h>
#include <linux/if.h>
#include <linux/if_tun.h>
#include <sched.h>
#include <sys/epoll.h>
#include <sys/ioctl.h>
#include <sys/signalfd.h>
#include <sys/timerfd.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <iostream>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>
#include <utility>

#include "bench/rules/direction.h"

namespace pmcd::bench {
namespace {

constexpr std::size_t kMaxPacket = 65536;

[[noreturn]] void fail(const std::string& what) {
  throw std::runtime_error(what + ": " + std::strerror(errno));
}

int checked(int result, const std::string& what) {
  if (result < 0) fail(what);
  return result;
}

/// A tun device `NAMESPACE:DEVICE`, made in that namespace, in which this process is afterwards.
int open_tun(const std::string& place) {
  const std::size_t colon = place.find(':');
  if (colon == std::string::npos || colon == 0 || place.size() - colon > IFNAMSIZ || place.size() == colon + 1) {
    throw std::runtime_error("\"" + place + "\" is not NAMESPACE:DEVICE");
  }
  const std::string path = "/run/netns/" + place.substr(0, colon);
  const int netns = checked(::open(path.c_str(), O_RDONLY | O_CLOEXEC), path);
  checked(::setns(netns, CLONE_NEWNET), "entering " + path);
  ::close(netns);
  const int tun = checked(::open("/dev/net/tun", O_RDWR | O_NONBLOCK | O_CLOEXEC), "/dev/net/tun");
  ifreq request{};
  request.ifr_flags = IFF_TUN | IFF_NO_PI;
  place.copy(request.ifr_name, IFNAMSIZ - 1, colon + 1);
  checked(::ioctl(tun, TUNSETIFF, &request), "making " + place);
  return tun;
}

class Relay {
 public:
  Relay(std::array<int, 2> tuns, const std::array<DirectionOptions, 2>& options)
      : tuns_(tuns), directions_{Direction(options[0]), Direction(options[1])} {
    epoll_ = checked(::epoll_create1(EPOLL_CLOEXEC), "epoll");
    timer_ = checked(::timerfd_create(CLOCK_MONOTONIC, TFD_NONBLOCK | TFD_CLOEXEC), "timerfd");
    sigset_t ends;
    sigemptyset(&ends);
    sigaddset(&ends, SIGTERM);
    sigaddset(&ends, SIGINT);
    checked(::sigprocmask(SIG_BLOCK, &ends, nullptr), "sigprocmask");
    signals_ = checked(::signalfd(-1, &ends, SFD_CLOEXEC), "signalfd");
    for (const int fd : {tuns_[0], tuns_[1], timer_, signals_}) {
      epoll_event event{};
      event.events = EPOLLIN;
      event.data.fd = fd;
      checked(::epoll_ctl(epoll_, EPOLL_CTL_ADD, fd, &event), "epoll_ctl");
    }
  }

  void run() {
    std::array<epoll_event, 4> events{};
    while (true) {
      const int count = ::epoll_wait(epoll_, events.data(), static_cast<int>(events.size()), -1);
      if (count < 0 && errno != EINTR) fail("epoll_wait");
      for (int i = 0; i < count; ++i) {
        const int fd = events.at(static_cast<std::size_t>(i)).data.fd;
        if (fd == signals_) return;
        if (fd == timer_) {
          std::uint64_t expirations = 0;
          // Whether it expired does not matter: what is due is sent below.
          [[maybe_unused]] const ssize_t got = ::read(timer_, &expirations, sizeof expirations);
        } else {
          take(fd == tuns_[0] ? 0 : 1);
        }
      }
      send_what_is_due();
    }
  }

  [[nodiscard]] nlohmann::json counts() const {
    const auto one = [](const DirectionCounts& counts) {
      return nlohmann::json{{"packets", counts.packets},
                            {"bytes", counts.bytes},
                            {"lost", counts.lost},
                            {"crowded", counts.crowded},
                            {"refused", counts.refused}};
    };
    return {{"there", one(directions_[0].counts())}, {"back", one(directions_[1].counts())}};
  }

 private:
  void take(std::size_t side) {
    while (true) {
      const ssize_t count = ::read(tuns_.at(side), buffer_.data(), buffer_.size());
      if (count <= 0) {
        // EIO, EBADFD: the device is down.
        if (count == 0 || errno == EAGAIN || errno == EIO || errno == EBADFD) return;
        if (errno == EINTR) continue;
        fail("reading a tun device");
      }
      directions_.at(side).arrive({buffer_.begin(), buffer_.begin() + count}, Clock::now());
    }
  }

  void send_what_is_due() {
    const Clock::time_point now = Clock::now();
    std::optional<Clock::time_point> next;
    for (const std::size_t side : {0U, 1U}) {
      Direction& direction = directions_.at(side);
      while (const auto packet = direction.depart(now)) {
        if (::write(tuns_.at(1 - side), packet->data(), packet->size()) == static_cast<ssize_t>(packet->size())) {
          direction.count_forwarded(packet->size());
        } else {
          direction.count_refused();
        }
      }
      const auto due = direction.due();
      if (due && (!next || *due < *next)) next = due;
    }
    itimerspec setting{};
    if (next) {
      const auto since = next->time_since_epoch();
      const auto seconds = std::chrono::duration_cast<std::chrono::seconds>(since);
      setting.it_value.tv_sec = seconds.count();
      setting.it_value.tv_nsec = std::chrono::nanoseconds(since - seconds).count();
    }
    checked(::timerfd_settime(timer_, TFD_TIMER_ABSTIME, &setting, nullptr), "timerfd_settime");
  }

  std::array<int, 2> tuns_;
  std::array<Direction, 2> directions_;  ///< [0] from tuns_[0] to tuns_[1], [1] back
  int epoll_ = -1;
  int timer_ = -1;
  int signals_ = -1;
  std::array<std::byte, kMaxPacket> buffer_{};
};

/// What is given once holds both ways.
template <typename T>
T each_way(const std::vector<T>& values, std::size_t way) {
  return values.at(std::min(way, values.size() - 1));
}

}  // namespace
}  // namespace pmcd::bench

int main(int argc, char** argv) try {
  using namespace pmcd::bench;
  CLI::App app{
      "rules_relay: a line with delay and loss between two network namespaces. Options that take two values: "
      "there (from the first to the second device) and back; one value holds for both."};
  std::array<std::string, 2> places;
  std::vector<double> delay_ms{0};
  std::vector<double> loss{0};
  std::vector<double> rate_kbit{0};
  std::vector<std::uint64_t> seed{1};
  std::vector<std::size_t> queue_bytes{0};
  app.add_option("first", places[0], "NAMESPACE:DEVICE, made here")->required();
  app.add_option("second", places[1], "NAMESPACE:DEVICE, made here")->required();
  app.add_option("--delay-ms", delay_ms, "How long a packet is under way")
      ->expected(1, 2)
      ->check(CLI::Range(0.0, 60000.0));
  app.add_option("--loss", loss, "Probability that a packet is lost")->expected(1, 2)->check(CLI::Range(0.0, 1.0));
  app.add_option("--seed", seed, "Which packets are lost; the same ones for the same seed")->expected(1, 2);
  app.add_option("--rate-kbit", rate_kbit, "Rate in 1000 bits a second of IP packets; 0: unlimited")
      ->expected(1, 2)
      ->check(CLI::Range(0.0, 1e7));
  app.add_option("--queue-bytes", queue_bytes, "Bytes that may wait for the rate; 0: any number")->expected(1, 2);
  CLI11_PARSE(app, argc, argv);

  std::array<DirectionOptions, 2> options;
  for (const std::size_t way : {0U, 1U}) {
    options.at(way).delay = std::chrono::duration_cast<std::chrono::nanoseconds>(
        std::chrono::duration<double, std::milli>(each_way(delay_ms, way)));
    options.at(way).loss = each_way(loss, way);
    // One seed for both ways must not lose the same numbers both ways.
    options.at(way).seed = seed.size() == 1 ? 2 * seed[0] + way : seed[way];
    options.at(way).queue_bytes = each_way(queue_bytes, way);
    options.at(way).bytes_per_second = each_way(rate_kbit, way) * 1000 / 8;
  }
  const int first = open_tun(places[0]);
  Relay relay({first, open_tun(places[1])}, options);
  std::cout << nlohmann::json{{"ready", true}} << std::endl;
  relay.run();
  std::cout << relay.counts() << std::endl;
  return 0;
} catch (const std::exception& error) {
  std::cerr << "rules_relay: " << error.what() << '\n';
  return 1;
}
