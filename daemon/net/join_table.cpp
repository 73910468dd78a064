// SPDX-License-Identifier: MIT
// Tokens from getrandom.
#include "daemon/net/join_table.h"

#include <sys/random.h>

namespace pmcd::net {

std::optional<proto::Token> JoinTable::issue(const std::shared_ptr<Session>& session) {
  proto::Token token;
  // Up to 256 bytes come whole once the kernel's pool is ready, which it is long before a daemon starts.
  if (::getrandom(token.data(), token.size(), 0) != static_cast<ssize_t>(token.size())) return std::nullopt;
  if (!waiting_.try_emplace(token, session).second) return std::nullopt;
  return token;
}

std::shared_ptr<Session> JoinTable::redeem(const proto::Token& token) {
  const auto it = waiting_.find(token);
  if (it == waiting_.end()) return nullptr;
  std::shared_ptr<Session> session = it->second.lock();
  waiting_.erase(it);
  return session;
}

}  // namespace pmcd::net
