// SPDX-License-Identifier: MIT
// The tokens by which a data connection finds its session: 128 bits from the kernel's random source, each good once and
// only until its time is over. It reads no clock: expiry is the session's own deadline, which takes the token back.
#pragma once

#include <cstddef>
#include <map>
#include <memory>
#include <optional>

#include "proto/messages.h"

namespace pmcd::net {

class Session;

class JoinTable {
 public:
  /// A fresh token for `session`; none if the kernel gives no random bytes.
  std::optional<proto::Token> issue(const std::shared_ptr<Session>& session);
  /// The session of a token, which is used up by this; null if it is unknown, used or taken back.
  std::shared_ptr<Session> redeem(const proto::Token& token);
  /// Takes a token back, if it was not used.
  void revoke(const proto::Token& token) { waiting_.erase(token); }
  [[nodiscard]] std::size_t waiting() const { return waiting_.size(); }

 private:
  std::map<proto::Token, std::weak_ptr<Session>> waiting_;
};

}  // namespace pmcd::net
