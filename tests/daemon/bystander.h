// SPDX-License-Identifier: MIT
// A well-behaved client that goes on while others misbehave, and measures what it feels of it: it pings every few
// milliseconds in a thread of its own.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <thread>
#include <vector>

#include "tests/daemon/latencies.h"
#include "tests/daemon/raw_client.h"

namespace pmcd::test {

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
    return Latencies(times_);
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
