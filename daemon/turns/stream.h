// SPDX-License-Identifier: MIT
// A client's data channel as a stream of bytes, as far as turns depend on it: a socket in the daemon, a modelled
// connection in the simulator. Positions are in bytes from its begin.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "daemon/scheduler/request.h"

namespace pmcd::turns {

using scheduler::Time;

/// What a kernel measures of a TCP connection.
struct TcpState {
  double delivery_rate = 0;         ///< bytes a second, of the last round trip with enough to send
  bool application_limited = true;  ///< that was not enough: the rate says what was sent, not what could be
  std::uint64_t sacked_bytes = 0;   ///< about: received beyond a segment that is missing, and so not acknowledged yet
  Time least_round_trip{0};         ///< 0: not known
  std::chrono::milliseconds last_acknowledged{0};  ///< so long ago the last acknowledgement came
};

class Stream {
 public:
  Stream() = default;
  Stream(const Stream&) = delete;
  Stream& operator=(const Stream&) = delete;
  virtual ~Stream() = default;

  /// Where that ends what was queued last.
  [[nodiscard]] virtual std::uint64_t queued_position() const = 0;
  /// Bytes of it that no socket has taken.
  [[nodiscard]] virtual std::uint64_t unwritten() const = 0;
  /// Whether more may be queued.
  [[nodiscard]] virtual bool has_room() const = 0;
  /// Up to where the client has acknowledged. [one system call]
  virtual std::uint64_t acknowledged_position() = 0;
  /// What that was when it was asked last.
  [[nodiscard]] virtual std::uint64_t last_acknowledged() const = 0;
  /// None if it is no TCP or closed. [one system call]
  virtual std::optional<TcpState> tcp_state() = 0;
  /// Whether the kernel has sent all that was written; true of a closed one. [one system call]
  virtual bool has_left() = 0;
  /// The kernel is to hold no more than so many bytes that it has not sent. [one system call]
  virtual void bound_unsent(std::size_t bytes) = 0;
};

}  // namespace pmcd::turns
