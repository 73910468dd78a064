// SPDX-License-Identifier: MIT
// Listening sockets and the loop that accepts from them. The loop never ends by an error and never spins: out of
// descriptors, it says so once and tries again every 100 ms.
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <exception>
#include <functional>
#include <optional>
#include <string>
#include <variant>

#include "daemon/net/asio.h"

namespace pmcd::net {

/// A sentence that says what is wrong.
struct ListenError {
  std::string text;
};
template <typename T>
using ListenResult = std::variant<T, ListenError>;

/// Listens on a numeric address; port 0 takes any free one.
ListenResult<TcpAcceptor> listen_tcp(const Executor& executor, const std::string& address, std::uint16_t port);

/// Listens on a Unix socket of mode 0660. A socket file on which nobody answers is replaced; anything else that stands
/// at the path (a socket that answers, a file) is left alone and is an error.
ListenResult<UnixAcceptor> listen_unix(const Executor& executor, const std::string& path);

/// Accepts until the acceptor is closed and gives each connection to `serve`. `name`: for the log.
template <typename Acceptor, typename Serve>
awaitable<void> accept_loop(Acceptor& acceptor, const char* name, Serve serve);

/// What accept_loop does on an error: logs the first of a row and waits.
class AcceptTrouble {
 public:
  AcceptTrouble(Executor executor, const char* name) : executor_(std::move(executor)), name_(name) {}
  awaitable<void> pause(const error_code& error);
  void over();
  void not_served(const std::exception& failure) const;

 private:
  Executor executor_;
  const char* name_;
  std::uint64_t in_a_row_ = 0;
};

template <typename Acceptor, typename Serve>
awaitable<void> accept_loop(Acceptor& acceptor, const char* name, Serve serve) {
  AcceptTrouble trouble(acceptor.get_executor(), name);
  while (acceptor.is_open()) {
    error_code error;
    auto socket = co_await acceptor.async_accept(resume_with(error));
    if (!acceptor.is_open()) break;
    if (error) {
      co_await trouble.pause(error);
      continue;
    }
    trouble.over();
    try {
      serve(std::move(socket));
    } catch (const std::exception& failure) {
      trouble.not_served(failure);  // out of memory, most likely: that connection is gone, the next may fare better
    }
  }
}

}  // namespace pmcd::net
