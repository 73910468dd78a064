// SPDX-License-Identifier: MIT
// A well-behaved client that goes on while others misbehave, and measures what it feels of it: it pings every few
// milliseconds in a thread of its own.
#pragma once

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <thread>
#include <vector>

#include "tests/daemon/raw_client.h"

namespace pmcd::test {

/// Times in ms, in ascending order.
struct Latencies {
  std::vector<double> sorted;

  /// The time that a `share` (0 to 1) of all does not exceed.
  [[nodiscard]] double quantile(double share) const {
    if (sorted.empty()) return 0;
    const auto at = static_cast<std::size_t>(share * static_cast<double>(sorted.size()));
    return sorted[std::min(at, sorted.size() - 1)];
  }
};

class Bystander {
 public:
  explicit Bystander(std::uint16_t request_port)
      : session_(RawSession::open(request_port)), thread_([this] { run(); }) {}
  Bystander(const Bystander&) = delete;
  Bystander& operator=(const Bystander&) = delete;
  ~Bystander() { stop(); }

  /// Ends it. A ping without an answer was a test failure.
  Latencies stop() {
    stopped_ = true;
    if (thread_.joinable()) thread_.join();
    std::sort(times_.begin(), times_.end());
    return {times_};
  }

 private:
  void run() {
    for (std::uint32_t id = 1; !stopped_; ++id) {
      const auto start = std::chrono::steady_clock::now();
      session_.requests.send(proto::encode(proto::Ping{id}));
      if (expect<proto::Pong>(session_.requests).id != id) return;
      times_.push_back(std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count());
      std::this_thread::sleep_for(std::chrono::milliseconds(3));
    }
  }

  RawSession session_;
  std::vector<double> times_;
  std::atomic<bool> stopped_ = false;
  std::thread thread_;
};

}  // namespace pmcd::test
