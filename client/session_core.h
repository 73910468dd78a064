// SPDX-License-Identifier: MIT
// The inside of a Session: both channels, what came in on them, and the one place where time is waited for. session.cpp
// builds the calls on top of it; connecting.cpp brings it up; incoming.cpp says what each frame means. Not part of the
// library's public face.
#pragma once

#include <boost/asio/io_context.hpp>
#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <stop_token>
#include <string>

#include "client/channel.h"
#include "client/lookup.h"
#include "client/session.h"
#include "client/transfer.h"

namespace pmcd::client {

class Session::Core {
 public:
  using Clock = std::chrono::steady_clock;
  using Condition = std::function<bool()>;

  struct Mesh {
    OpenedMesh opened;
    std::uint32_t place = 0;             ///< packets that were given out
    std::optional<std::uint32_t> asked;  ///< the transfer that brings packet `place`, if it was asked for already
    proto::Bytes begun;                  ///< what a transfer that was cancelled brought of packet `place`
  };

  explicit Core(const Options& options);
  ~Core();
  Core(const Core&) = delete;
  Core& operator=(const Core&) = delete;

  std::optional<Error> connect(const Address& address);

  /// Runs the channels until `done`, or until the session failed; then the error. For everything but connecting.
  std::optional<Error> wait(const Condition& done) { return wait(done, options_.progress_timeout); }
  /// The same with another limit on the time without a byte on the data channel.
  std::optional<Error> wait(const Condition& done, std::chrono::milliseconds progress_timeout);
  /// Makes a wait look at its condition again. The one function that any thread may call.
  void wake();

  /// A new open request, waiting first if the server allows no more. `begun`: bytes before its first chunk.
  Result<std::uint32_t> start_request(std::uint64_t max_bytes, proto::Bytes begun = {});
  /// Says that mesh_opened will come for the request, and which packet its transfer then brings.
  void expect_opened(std::uint32_t id, std::uint32_t packet) { awaiting_opened_[id] = packet; }
  /// The request that brings packet `mesh.place`: the one under way, or a new one behind what was begun. Behind the
  /// last packet it brings end_of_mesh.
  Result<std::uint32_t> ask_for_next(Mesh& mesh);
  void send_request(proto::Bytes frame) { request_.send(std::move(frame)); }
  /// nullptr once it was dropped or refused.
  Transfer* transfer(std::uint32_t id);
  /// Forgets a transfer that has ended; cancels one that has not, and lets go what still comes of it.
  void drop(std::uint32_t id);

  /// The error that the server sent for a request, if it did; taken off.
  std::optional<Error> take_refusal(std::uint32_t id);
  /// The mesh that the server opened for a request, if it has; taken off.
  std::optional<OpenedMesh> take_opened(std::uint32_t id);
  [[nodiscard]] bool has_refusal(std::uint32_t id) const { return refusals_.count(id) != 0; }
  [[nodiscard]] bool has_opened(std::uint32_t id) const { return opened_.count(id) != 0; }

  /// Ends the session for good with this error, and returns the error that ended it.
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
  std::optional<Error> connect_channel(Channel& channel, const std::string& name, const Endpoints& endpoints,
                                       Clock::time_point deadline);
  std::optional<Error> say_hello(const std::string& where, Clock::time_point deadline);
  /// Runs until `done`, failure (then the error), or `until`; nullopt for the first and the last.
  std::optional<Error> run(const Condition& done, Clock::time_point until);
  /// The same where reaching the deadline is an error; `what` says what did not come.
  std::optional<Error> run_or_time_out(const Condition& done, Clock::time_point deadline, const std::string& what);

  void on_request_frame(const proto::Frame& frame);
  void on_data_frame(const proto::Frame& frame);
  void on_chunk(const proto::ChunkView& chunk);
  void on_transfer_end(const proto::Frame& frame);
  void on_error_frame(const proto::Frame& frame, bool on_data);
  void on_opened(const proto::Frame& frame);
  void on_notice(const proto::Frame& frame);
  void on_end(const char* channel, const std::string& why, bool broken_frames);
  void save_unfinished_chunk();
  void violation(const std::string& what);
  template <typename M>
  std::optional<M> read(const proto::Frame& frame);

  Options options_;
  boost::asio::io_context io_;
  Channel request_{io_, proto::kMaxAnswerFrame};
  Channel data_{io_, proto::kMaxDataFrame};

  std::optional<proto::HelloOk> hello_ok_;
  bool join_ok_ = false;
  std::string server_agent_;
  std::uint32_t last_id_ = 0;
  std::map<std::uint32_t, Transfer> transfers_;
  std::map<std::uint32_t, std::uint32_t> awaiting_opened_;  ///< request: the packet that it brings
  std::map<std::uint32_t, Error> refusals_;
  std::map<std::uint32_t, OpenedMesh> opened_;
  std::map<std::uint32_t, Mesh> meshes_;
  std::uint32_t last_pong_ = 0;

  Clock::time_point heard_at_;
  Clock::time_point progress_at_;
  Clock::time_point lost_at_;
  std::optional<Error> lost_;  ///< a channel ended; the other may still say why
  std::optional<Error> failure_;

  /// Last, so that it goes first: it may call wake() from another thread until then.
  std::stop_callback<std::function<void()>> on_stop_;
};

/// The sentence for a time: "10 s", "250 ms".
std::string in_words(std::chrono::milliseconds time);

}  // namespace pmcd::client
