// SPDX-License-Identifier: MIT
// From an address to a session that stands: look-up, both connections, hello and join, all within one time-out.
#include <boost/asio/connect.hpp>
#include <utility>

#include "client/session_core.h"

namespace pmcd::client {

using boost::asio::ip::tcp;
using boost::system::error_code;

std::optional<Error> Session::Core::connect(const Address& address) {
  const std::string where = to_string(address);
  const auto deadline = Clock::now() + options_.connect_timeout;

  Endpoints endpoints;
  {
    const Lookup lookup(io_, address.host, address.port);
    if (auto error = run_or_time_out([&] { return lookup.done(); }, deadline, "looking up " + address.host)) {
      return error;
    }
    endpoints = lookup.endpoints();
    if (endpoints.empty()) {
      return fail({Failure::cannot_reach, proto::ErrorCode::none,
                   "cannot find the host \"" + address.host + "\": " + lookup.failure()});
    }
  }
  if (auto error = connect_channel(request_, where, endpoints, deadline)) return error;
  if (auto error = say_hello(where, deadline)) return error;

  error_code no_peer;
  tcp::endpoint data_endpoint = request_.socket().remote_endpoint(no_peer);
  if (no_peer) {
    return fail({Failure::lost, proto::ErrorCode::none, "the request channel was lost: " + no_peer.message()});
  }
  data_endpoint.port(hello_ok_->data_port);
  if (auto error = connect_channel(data_, to_string({address.host, hello_ok_->data_port}) + " (data channel)",
                                   {data_endpoint}, deadline)) {
    return error;
  }
  data_.start([this](const proto::Frame& frame) { on_data_frame(frame); },
              [this] { heard_at_ = progress_at_ = Clock::now(); },
              [this](const std::string& why, bool broken) { on_end("data", why, broken); });
  data_.send(proto::encode(proto::Join{{}, hello_ok_->token}));
  return run_or_time_out([this] { return join_ok_; }, deadline, where + " did not answer join");
}

std::optional<Error> Session::Core::say_hello(const std::string& where, Clock::time_point deadline) {
  request_.start([this](const proto::Frame& frame) { on_request_frame(frame); }, [this] { heard_at_ = Clock::now(); },
                 [this](const std::string& why, bool broken) { on_end("request", why, broken); });
  request_.send(proto::encode(proto::Hello{{}, options_.agent}));
  if (auto error = run_or_time_out([this] { return hello_ok_.has_value(); }, deadline,
                                   where + " did not answer hello (is it a pmcd server's request port?)")) {
    return error;
  }
  server_agent_ = hello_ok_->agent;
  return std::nullopt;
}

std::optional<Error> Session::Core::connect_channel(Channel& channel, const std::string& name,
                                                    const Endpoints& endpoints, Clock::time_point deadline) {
  // Shared: when this call gives up, the operation goes on until its socket is closed and the io_context is gone.
  const auto connected = std::make_shared<std::optional<error_code>>();
  boost::asio::async_connect(channel.socket(), endpoints,
                             [connected](const error_code& error, const tcp::endpoint&) { *connected = error; });
  if (auto error = run_or_time_out([&] { return connected->has_value(); }, deadline, "connecting to " + name)) {
    return error;
  }
  if (!**connected) return std::nullopt;
  return fail(
      {Failure::cannot_reach, proto::ErrorCode::none,
       "cannot reach " + name + ": " + (*connected)->message() + " (is pmcd running there, and is the port right?)"});
}

}  // namespace pmcd::client
