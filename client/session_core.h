// SPDX-License-Identifier: MIT
// The inside of a Session: both channels, what came in on them, and the one place where time is waited for. session.cpp
// builds the calls on top of it. Not part of the library's public face.
#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>

#include "client/channel.h"
#include "client/session.h"
#include "client/transfer.h"

namespace pmcd::client {

class Session::Core {
 public:
  using Clock = std::chrono::steady_clock;
  using Condition = std::function<bool()>;

  struct Mesh {
    OpenedMesh opened;
    std::uint32_t place = 0;               ///< packets that were given out
    std::optional<std::uint32_t> base_id;  ///< the transfer of packet 0, until it was given out
  };

  explicit Core(const Options& options);

  std::optional<Error> connect(const Address& address);

  /// Runs the channels until `done`, or until the session failed; then the error. For everything but connecting.
  std::optional<Error> wait(const Condition& done);

  /// A new open request, waiting first if the server allows no more. `opens_mesh`: mesh_opened is to come.
  Result<std::uint32_t> start_request(std::uint64_t max_bytes, bool opens_mesh);
  void send_request(proto::Bytes frame) { request_.send(std::move(frame)); }
  /// nullptr once it was dropped or refused.
  Transfer* transfer(std::uint32_t id);
  /// Forgets a transfer that has ended, or lets its bytes go when they come.
  void drop(std::uint32_t id);

  /// The error that the server sent for a request, if it did; taken off.
  std::optional<Error> take_refusal(std::uint32_t id);
  /// The answer to get_base_mesh, if it has come; taken off.
  std::optional<OpenedMesh> take_opened(std::uint32_t id);
  [[nodiscard]] bool has_refusal(std::uint32_t id) const { return refusals_.count(id) != 0; }
  [[nodiscard]] bool has_opened(std::uint32_t id) const { return opened_.count(id) != 0; }

  /// Ends the session for good with this error, and returns it.
  Error fail(Error error);
  [[nodiscard]] const std::optional<Error>& failure() const { return failure_; }
  void close();

  const Options& options() const { return options_; }
  const std::string& server_agent() const { return server_agent_; }
  std::map<std::uint32_t, Mesh>& meshes() { return meshes_; }
  /// The id of the last pong that came.
  [[nodiscard]] std::uint32_t last_pong() const { return last_pong_; }
  std::uint32_t next_id();

 private:
  std::optional<Error> connect_channel(Channel& channel, const std::string& name,
                                       const boost::asio::ip::tcp::resolver::results_type& endpoints,
                                       Clock::time_point deadline);
  /// Runs until `done`, failure (then the error), or `until`; nullopt for the first and the last.
  std::optional<Error> run(const Condition& done, Clock::time_point until);
  /// The same where reaching the deadline is an error; `what` says what did not come.
  std::optional<Error> run_or_time_out(const Condition& done, Clock::time_point deadline, const std::string& what);

  void on_request_frame(const proto::Frame& frame);
  void on_data_frame(const proto::Frame& frame);
  void on_error_frame(const proto::Frame& frame, bool on_data);
  void on_opened(const proto::Frame& frame);
  void on_end(const char* channel, const std::string& why, bool broken_frames);
  void violation(const std::string& what);
  template <typename M>
  std::optional<M> read(const proto::Frame& frame);

  Options options_;
  boost::asio::io_context io_;
  boost::asio::ip::tcp::resolver resolver_{io_};
  Channel request_{io_, proto::kMaxAnswerFrame};
  Channel data_{io_, proto::kMaxDataFrame};

  std::optional<proto::HelloOk> hello_ok_;
  bool join_ok_ = false;
  std::string server_agent_;
  std::uint32_t last_id_ = 0;
  std::map<std::uint32_t, Transfer> transfers_;
  std::set<std::uint32_t> awaiting_opened_;  ///< ids of get_base_mesh without an answer
  std::map<std::uint32_t, Error> refusals_;
  std::map<std::uint32_t, OpenedMesh> opened_;
  std::map<std::uint32_t, Mesh> meshes_;
  std::uint32_t last_pong_ = 0;

  Clock::time_point heard_at_;
  Clock::time_point progress_at_;
  Clock::time_point lost_at_;
  std::optional<Error> lost_;  ///< a channel ended; the other may still say why
  std::optional<Error> failure_;
};

}  // namespace pmcd::client
