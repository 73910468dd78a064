// SPDX-License-Identifier: MIT
// A session's data channel as turns see it. Nothing is decided here.
#pragma once

#include <memory>
#include <optional>
#include <utility>

#include "daemon/net/channel.h"
#include "daemon/net/socket_state.h"
#include "daemon/net/tcp_info.h"
#include "daemon/turns/stream.h"

namespace pmcd::net {

class DataStream final : public turns::Stream {
 public:
  /// REQUIRES: not null.
  explicit DataStream(std::shared_ptr<Channel> channel) : channel_(std::move(channel)) {}

  [[nodiscard]] std::uint64_t queued_position() const override { return channel_->queued_position(); }
  [[nodiscard]] std::uint64_t unwritten() const override { return channel_->unwritten(); }
  [[nodiscard]] bool has_room() const override { return channel_->has_room(); }
  std::uint64_t acknowledged_position() override { return channel_->acknowledged_position(); }
  [[nodiscard]] std::uint64_t last_acknowledged() const override { return channel_->last_acknowledged(); }
  std::optional<turns::TcpState> tcp_state() override {
    return channel_->is_open() ? net::tcp_state(channel_->native_handle()) : std::nullopt;
  }
  bool has_left() override { return !channel_->is_open() || unsent_bytes(channel_->native_handle()) == 0; }
  void bound_unsent(std::size_t bytes) override {
    if (channel_->is_open()) net::bound_unsent(channel_->native_handle(), bytes);
  }

 private:
  std::shared_ptr<Channel> channel_;
};

}  // namespace pmcd::net
