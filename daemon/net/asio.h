// SPDX-License-Identifier: MIT
// Boost.Asio as the network room uses it: errors as values, and a timer that serves as a condition. Boost 1.74 with
// g++ 12 needs <utility> before Asio's coroutine headers, so everyone includes this file and not Asio itself.
// Another trap of g++ 12: a lambda or aggregate that is written inside a co_await expression is destroyed twice. Give
// it a name first, then std::move() it in.
#pragma once

#include <utility>  // must come first
//
#include <boost/asio/awaitable.hpp>
#include <boost/asio/buffer.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/generic/stream_protocol.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/local/stream_protocol.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/redirect_error.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <chrono>
#include <cstddef>

namespace pmcd::net {

namespace asio = boost::asio;
using boost::system::error_code;
using Clock = std::chrono::steady_clock;
using Duration = Clock::duration;

// The house runs on io_contexts only. Asio's default, an executor of any kind, costs a virtual call and an allocation
// here and there for every operation: a tenth of the CPU time of serving small packets.
using Executor = asio::io_context::executor_type;
template <typename T>
using awaitable = asio::awaitable<T, Executor>;
using Timer = asio::basic_waitable_timer<Clock, asio::wait_traits<Clock>, Executor>;
using StreamSocket = asio::basic_stream_socket<asio::generic::stream_protocol, Executor>;
using TcpSocket = asio::basic_stream_socket<asio::ip::tcp, Executor>;
using UnixSocket = asio::basic_stream_socket<asio::local::stream_protocol, Executor>;
using TcpAcceptor = asio::basic_socket_acceptor<asio::ip::tcp, Executor>;
using UnixAcceptor = asio::basic_socket_acceptor<asio::local::stream_protocol, Executor>;
inline constexpr asio::use_awaitable_t<Executor> kUseAwaitable;

/// The completion token of the house: resumes the coroutine and puts the error into `error` instead of throwing it.
inline auto resume_with(error_code& error) {
  return asio::redirect_error(kUseAwaitable, error);
}

/// Sleeps; returns early and quietly if the timer is cancelled.
inline awaitable<void> sleep_for(Executor executor, Duration duration) {
  Timer timer(executor, duration);
  error_code ignored;
  co_await timer.async_wait(resume_with(ignored));
}

/// What coroutines of one thread wait on until somebody notifies them. A waiter looks again at what it waits for (and
/// at the clock, if it waits with a limit): it may be woken for nothing.
class Condition {
 public:
  explicit Condition(const Executor& executor) : timer_(executor, Clock::time_point::max()) {}

  awaitable<void> wait_until(Clock::time_point limit = Clock::time_point::max()) {
    if (timer_.expiry() <= Clock::now()) timer_.expires_at(Clock::time_point::max());
    if (limit < timer_.expiry()) timer_.expires_at(limit);  // wakes the other waiters, which then wait again
    error_code ignored;
    ++waiting_;
    co_await timer_.async_wait(resume_with(ignored));
    --waiting_;
  }
  void notify() {
    if (waiting_ > 0) timer_.cancel();
  }

 private:
  Timer timer_;
  std::size_t waiting_ = 0;
};

}  // namespace pmcd::net
