// SPDX-License-Identifier: MIT
// The server's end of a modelled connection: queues bytes, hands them to its socket as that takes them, and says what
// the kernel would.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>

#include "daemon/turns/stream.h"
#include "sim/connection.h"
#include "sim/timeline.h"

namespace pmcd::sim {

class ServerStream final : public turns::Stream {
 public:
  /// Sets the connection's on_writable. REQUIRES: both outlive it.
  ServerStream(Timeline& timeline, Connection& connection);

  /// So many bytes leave at the end of this moment, with what else is queued in it.
  void queue(std::uint64_t bytes);
  /// Nothing of it happens any more.
  void close() { is_open_ = false; }
  /// Something was written.
  std::function<void()> on_progress;

  [[nodiscard]] std::uint64_t queued_position() const override { return queued_; }
  [[nodiscard]] std::uint64_t unwritten() const override { return queued_ - written_; }
  [[nodiscard]] bool has_room() const override;
  std::uint64_t acknowledged_position() override { return acknowledged_ = connection_.acknowledged(); }
  [[nodiscard]] std::uint64_t last_acknowledged() const override { return acknowledged_; }
  std::optional<turns::TcpState> tcp_state() override;
  bool has_left() override { return connection_.unsent() == 0; }
  void bound_unsent(std::size_t bytes) override { unsent_bound_ = bytes; }

 private:
  void flush();

  Timeline& timeline_;
  Connection& connection_;
  bool is_open_ = true;
  bool flush_is_due_ = false;
  std::uint64_t queued_ = 0, written_ = 0, acknowledged_ = 0;
  std::uint64_t unsent_bound_;
};

}  // namespace pmcd::sim
