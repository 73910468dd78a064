// SPDX-License-Identifier: GPL-3.0-or-later
// The connection to the daemon: frames over its Unix socket, blocking, every wait with an end. Knows no command.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <variant>

#include "admin-cli/result.h"
#include "proto/admin.h"
#include "proto/frame.h"

namespace pmcd::admin {

/// A frame of the daemon with a body of its own.
struct Answer {
  std::uint16_t type = 0;
  proto::Bytes body;
};

class AdminLine {
 public:
  /// Connects and says hello. Failure: what to do about it stands in the text.
  static std::variant<AdminLine, Failure> open(const std::string& path);

  AdminLine(AdminLine&& other) noexcept;
  AdminLine& operator=(AdminLine&& other) noexcept;
  AdminLine(const AdminLine&) = delete;
  AdminLine& operator=(const AdminLine&) = delete;
  ~AdminLine();

  std::optional<Failure> send(proto::ByteView bytes);

  /// The next frame; an error frame becomes the Failure.
  std::variant<Answer, Failure> receive(std::chrono::milliseconds patience);

  /// True when something came already: receive() will not wait long.
  [[nodiscard]] bool has_news() const;

 private:
  AdminLine(int fd, std::string path) : fd_(fd), path_(std::move(path)) {}
  [[nodiscard]] Failure lost(const std::string& why) const;

  int fd_ = -1;
  std::string path_;
  proto::FrameReader reader_{proto::kMaxAdminFrame};
  proto::Bytes received_;
  proto::ByteView input_;  ///< what of received_ was not read yet
};

/// An Answer read as an M; a Failure when it is something else.
template <typename M>
std::variant<M, Failure> read_as(const Answer& answer) {
  if (answer.type != static_cast<std::uint16_t>(M::kType)) {
    return Failure{kRefused, proto::ErrorCode::none,
                   "the daemon answered with frame type " + std::to_string(answer.type) + ", which was not asked for"};
  }
  auto message = proto::decode<M>(answer.body);
  if (!message) {
    return Failure{kRefused, proto::ErrorCode::none, "the daemon's answer makes no sense: " + message.error().detail};
  }
  return std::move(message).value();
}

}  // namespace pmcd::admin
