// SPDX-License-Identifier: MIT
// The daemon's own Session, Dispatcher and Channel objects between two ends of socket pairs, on one io_context that the
// caller turns by hand: no thread, no port, no database. Beside each client stands a model of what it may expect.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <vector>

#include "daemon/net/session.h"
#include "tests/fuzz/client_model.h"
#include "tests/fuzz/memory_source.h"
#include "tests/fuzz/target.h"

namespace pmcd::fuzz {

/// One of a client's two connections, seen from the client.
class Line {
 public:
  Line(int socket, std::uint32_t max_frame) : socket_(socket), reader_(max_frame) {}
  ~Line() { close(); }
  Line(const Line&) = delete;
  Line& operator=(const Line&) = delete;

  void write(Input bytes) { out_.insert(out_.end(), bytes.begin(), bytes.end()); }
  /// Gives the socket what it takes, at most `most` bytes. Whether it took any.
  bool flush(std::size_t most);
  /// Takes at most `most` bytes from the socket and keeps them. Whether there were any.
  bool receive(std::size_t most);
  /// The next whole frame of what was received; its body is valid until the next call.
  std::optional<proto::Frame> next();
  void close();
  [[nodiscard]] bool is_open() const { return socket_ >= 0; }
  /// The server closed, and in the middle of a frame.
  [[nodiscard]] bool was_cut() const { return ended_ && in_.empty() && reader_.mid_frame(); }
  [[nodiscard]] bool all_written() const { return out_.empty() || !is_open(); }

 private:
  int socket_;
  bool ended_ = false;
  std::deque<std::byte> out_;
  proto::Bytes in_;         ///< received
  proto::Bytes being_cut_;  ///< of it, what reader_ takes apart
  proto::ByteView left_;
  proto::FrameReader reader_;
};

struct RigOptions {
  scheduler::Policy policy;
  std::size_t chunk_bytes = 256;
  std::size_t queued_bytes = 1'024;
  int socket_buffer = 4'608;  ///< of the server's sockets
};

class SessionRig {
 public:
  explicit SessionRig(const RigOptions& options);
  ~SessionRig();
  SessionRig(const SessionRig&) = delete;
  SessionRig& operator=(const SessionRig&) = delete;

  /// A client connects its request channel. Its number.
  std::size_t connect();
  [[nodiscard]] std::size_t clients() const { return clients_.size(); }
  [[nodiscard]] const ClientModel& model(std::size_t client) const { return clients_[client]->model; }
  /// Connects and joins the data channel, if the client has a token and has not joined.
  void join(std::size_t client);

  /// Sends any bytes; frames may be cut anywhere.
  void send(std::size_t client, proto::Channel channel, Input bytes);
  /// The operator changes the rule.
  void switch_to(scheduler::Policy policy);
  /// How much the client writes at a time.
  void set_piece(std::size_t client, std::size_t bytes) { clients_[client]->piece = bytes; }
  void close(std::size_t client, proto::Channel channel);
  /// Takes bytes off the socket and thinks about them later, when sync() or settle() comes.
  void receive(std::size_t client, proto::Channel channel, std::size_t most);
  /// Reads the request channel to its end, then looks at everything that came on either.
  void sync(std::size_t client);

  /// Runs at most `most` handlers. Whether any ran.
  bool turn(std::size_t most);
  /// The dispatcher looks whether the client has taken its data, as its watch does now and then.
  void look(std::size_t client);
  void retired(store::MeshId mesh);
  void drain();
  /// Everything is sent, received and looked at until nothing moves; lookups in the store are answered, packets are if
  /// `release`. Judges what should be over by then.
  void settle(bool release);
  /// All clients leave; nothing may be left.
  void finish();

  MemorySource& source() { return source_; }

 private:
  struct Client {
    explicit Client(const MemorySource& source, const net::Limits& limits) : model(source, limits) {}
    ClientModel model;
    std::uint64_t key = 0;
    std::weak_ptr<net::Session> session;
    std::weak_ptr<net::Channel> request_channel;
    std::weak_ptr<net::Channel> data_channel;
    std::unique_ptr<Line> request;
    std::unique_ptr<Line> data;
    proto::FrameReader sent_requests{proto::kMaxClientFrame};  ///< takes apart what the client sends
    proto::FrameReader sent_data{proto::kMaxClientFrame};
    bool garbage = false;  ///< it sent what is no frame: nothing behind that is read
    bool data_garbage = false;
    std::size_t piece = 1 << 20;
    /// Bytes that were queued on each channel when the session closed.
    std::optional<std::pair<std::uint64_t, std::uint64_t>> closed_at;
  };

  std::shared_ptr<net::Channel> make_channel(std::unique_ptr<Line>& line, std::uint32_t max_frame);
  net::awaitable<void> serve_data(std::shared_ptr<net::Channel> channel);
  /// What must hold after every handler.
  void check_daemon();
  /// One round of settle(). Whether anything moved.
  bool round();
  void flush(Client& client);

  std::size_t most_slots_ = 0;  ///< that any policy so far allowed
  net::Limits limits_;
  int socket_buffer_;
  net::asio::io_context io_;
  net::TaskGroup tasks_;
  MemorySource source_;
  net::Dispatcher dispatcher_;
  net::JoinTable tokens_;
  net::AnswerWatch answers_;
  net::SessionContext context_;
  std::vector<std::unique_ptr<Client>> clients_;
};

}  // namespace pmcd::fuzz
