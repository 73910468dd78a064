// SPDX-License-Identifier: MIT
// Connecting, waiting, and what each frame from the server means.
#include "client/session_core.h"

#include <algorithm>
#include <boost/asio/connect.hpp>
#include <utility>

namespace pmcd::client {

using boost::asio::ip::tcp;
using boost::system::error_code;
using std::chrono::milliseconds;

namespace {

/// How long a lost channel waits for the other one to say why.
constexpr milliseconds kLastWords{500};

Error refused(const proto::ErrorMessage& message) {
  std::string text = message.text;
  if (text.empty()) {
    const proto::CodeInfo* info = proto::find_code(static_cast<std::uint16_t>(message.code));
    text = info == nullptr ? "it did not say why" : std::string(info->sentence);
  }
  const std::string code =
      std::string(proto::code_name(message.code)) + ", " + std::to_string(static_cast<std::uint16_t>(message.code));
  return {Failure::refused, message.code, "the server refused (" + code + "): " + text};
}

std::string in_words(milliseconds time) {
  const auto ms = time.count();
  return ms % 1000 == 0 ? std::to_string(ms / 1000) + " s" : std::to_string(ms) + " ms";
}

}  // namespace

Session::Core::Core(const Options& options) : options_(options) {}

std::optional<Error> Session::Core::connect(const Address& address) {
  const std::string where = to_string(address);
  const auto deadline = Clock::now() + options_.connect_timeout;

  std::optional<error_code> looked_up;
  tcp::resolver::results_type endpoints;
  resolver_.async_resolve(address.host, std::to_string(address.port),
                          [&](const error_code& error, tcp::resolver::results_type results) {
                            looked_up = error;
                            endpoints = std::move(results);
                          });
  if (auto error = run_or_time_out([&] { return looked_up.has_value(); }, deadline, "looking up " + address.host)) {
    return error;
  }
  if (*looked_up) {
    return fail({Failure::cannot_reach, proto::ErrorCode::none,
                 "cannot find the host \"" + address.host + "\": " + looked_up->message()});
  }
  if (auto error = connect_channel(request_, where, endpoints, deadline)) return error;
  request_.start([this](const proto::Frame& frame) { on_request_frame(frame); }, [this] { heard_at_ = Clock::now(); },
                 [this](const std::string& why, bool broken) { on_end("request", why, broken); });
  request_.send(proto::encode(proto::Hello{{}, options_.agent}));
  if (auto error = run_or_time_out([this] { return hello_ok_.has_value(); }, deadline,
                                   where + " did not answer hello (is it a pmcd server's request port?)")) {
    return error;
  }
  server_agent_ = hello_ok_->agent;

  error_code no_peer;
  tcp::endpoint data_endpoint = request_.socket().remote_endpoint(no_peer);
  if (no_peer) {
    return fail({Failure::lost, proto::ErrorCode::none, "the request channel was lost: " + no_peer.message()});
  }
  data_endpoint.port(hello_ok_->data_port);
  const auto data_endpoints =
      tcp::resolver::results_type::create(data_endpoint, address.host, std::to_string(hello_ok_->data_port));
  if (auto error = connect_channel(data_, to_string({address.host, hello_ok_->data_port}) + " (data channel)",
                                   data_endpoints, deadline)) {
    return error;
  }
  data_.start([this](const proto::Frame& frame) { on_data_frame(frame); },
              [this] { heard_at_ = progress_at_ = Clock::now(); },
              [this](const std::string& why, bool broken) { on_end("data", why, broken); });
  data_.send(proto::encode(proto::Join{{}, hello_ok_->token}));
  return run_or_time_out([this] { return join_ok_; }, deadline, where + " did not answer join");
}

std::optional<Error> Session::Core::connect_channel(Channel& channel, const std::string& name,
                                                    const tcp::resolver::results_type& endpoints,
                                                    Clock::time_point deadline) {
  std::optional<error_code> connected;
  boost::asio::async_connect(channel.socket(), endpoints,
                             [&](const error_code& error, const tcp::endpoint&) { connected = error; });
  if (auto error = run_or_time_out([&] { return connected.has_value(); }, deadline, "connecting to " + name)) {
    return error;
  }
  if (!*connected) return std::nullopt;
  return fail(
      {Failure::cannot_reach, proto::ErrorCode::none,
       "cannot reach " + name + ": " + connected->message() + " (is pmcd running there, and is the port right?)"});
}

std::optional<Error> Session::Core::run(const Condition& done, Clock::time_point until) {
  while (!done()) {
    if (failure_) return failure_;
    const auto now = Clock::now();
    auto next = until;
    if (lost_) {
      if ((request_.ended() && data_.ended()) || now >= lost_at_ + kLastWords) return fail(*lost_);
      next = std::min(next, lost_at_ + kLastWords);
    }
    if (now >= until) return std::nullopt;
    io_.restart();
    io_.run_one_until(next);
  }
  return std::nullopt;
}

std::optional<Error> Session::Core::run_or_time_out(const Condition& done, Clock::time_point deadline,
                                                    const std::string& what) {
  if (auto error = run(done, deadline)) return error;
  if (done()) return std::nullopt;
  return fail(
      {Failure::timed_out, proto::ErrorCode::none, "no answer in " + in_words(options_.connect_timeout) + ": " + what});
}

std::optional<Error> Session::Core::wait(const Condition& done) {
  heard_at_ = progress_at_ = Clock::now();
  Clock::time_point pinged_at;
  for (;;) {
    // One ping for every half of the time-out that passes in silence.
    const auto ping_at = std::max(heard_at_, pinged_at) + options_.silence_timeout / 2;
    const auto silent_at = heard_at_ + options_.silence_timeout;
    const auto stuck_at = progress_at_ + options_.progress_timeout;
    if (auto error = run(done, std::min({ping_at, silent_at, stuck_at}))) return error;
    if (done()) return std::nullopt;
    const auto now = Clock::now();
    if (now >= heard_at_ + options_.silence_timeout) {
      return fail({Failure::timed_out, proto::ErrorCode::none,
                   "the server has been silent for " + in_words(options_.silence_timeout)});
    }
    if (now >= progress_at_ + options_.progress_timeout) {
      return fail(
          {Failure::timed_out, proto::ErrorCode::none,
           "the server is there, but sent nothing of what was asked for in " + in_words(options_.progress_timeout)});
    }
    if (now >= std::max(heard_at_, pinged_at) + options_.silence_timeout / 2) {
      request_.send(proto::encode(proto::Ping{0}));
      pinged_at = now;
    }
  }
}

std::uint32_t Session::Core::next_id() {
  do {
    ++last_id_;
  } while (last_id_ == 0 || transfers_.count(last_id_) != 0);
  return last_id_;
}

Result<std::uint32_t> Session::Core::start_request(std::uint64_t max_bytes, bool opens_mesh) {
  const auto open = [this] {
    return std::count_if(transfers_.begin(), transfers_.end(), [](const auto& t) { return !t.second.ended(); });
  };
  if (auto error = wait([&] { return open() < hello_ok_->max_open_requests; })) return *error;
  const std::uint32_t id = next_id();
  transfers_.emplace(id, Transfer(id, max_bytes));
  if (opens_mesh) awaiting_opened_.insert(id);
  return id;
}

Transfer* Session::Core::transfer(std::uint32_t id) {
  const auto found = transfers_.find(id);
  return found == transfers_.end() ? nullptr : &found->second;
}

void Session::Core::drop(std::uint32_t id) {
  refusals_.erase(id);
  Transfer* transfer = this->transfer(id);
  if (transfer == nullptr) return;
  if (transfer->ended()) {
    transfers_.erase(id);
  } else {
    transfer->discard();
  }
}

std::optional<Error> Session::Core::take_refusal(std::uint32_t id) {
  const auto found = refusals_.find(id);
  if (found == refusals_.end()) return std::nullopt;
  Error error = std::move(found->second);
  refusals_.erase(found);
  return error;
}

std::optional<OpenedMesh> Session::Core::take_opened(std::uint32_t id) {
  const auto found = opened_.find(id);
  if (found == opened_.end()) return std::nullopt;
  OpenedMesh opened = std::move(found->second);
  opened_.erase(found);
  return opened;
}

Error Session::Core::fail(Error error) {
  if (!failure_) failure_ = std::move(error);
  request_.close();
  data_.close();
  resolver_.cancel();
  return *failure_;
}

void Session::Core::close() {
  if (failure_) return;
  request_.send_last(proto::encode(proto::Goodbye{}));
  fail({Failure::lost, proto::ErrorCode::none, "the session was closed"});
}

void Session::Core::violation(const std::string& what) {
  fail({Failure::violation, proto::ErrorCode::none, "the server broke the protocol: " + what});
}

template <typename M>
std::optional<M> Session::Core::read(const proto::Frame& frame) {
  auto message = proto::decode<M>(frame.body);
  if (message) return std::move(message).value();
  violation(message.error().detail);
  return std::nullopt;
}

void Session::Core::on_request_frame(const proto::Frame& frame) {
  switch (static_cast<proto::FrameType>(frame.type)) {
    case proto::FrameType::hello_ok:
      if (hello_ok_) return violation("a second hello_ok");
      hello_ok_ = read<proto::HelloOk>(frame);
      return;
    case proto::FrameType::error:
      return on_error_frame(frame, false);
    case proto::FrameType::pong:
      if (const auto pong = read<proto::Pong>(frame)) last_pong_ = pong->id;
      return;
    case proto::FrameType::mesh_opened:
      return on_opened(frame);
    case proto::FrameType::notice:
      static_cast<void>(read<proto::Notice>(frame));  // nothing to be done: what it announces comes as an error
      return;
    default:
      // A later minor version may send what this one does not know.
      if (const char* name = proto::type_name(frame.type)) violation(std::string(name) + " on the request channel");
  }
}

void Session::Core::on_data_frame(const proto::Frame& frame) {
  switch (static_cast<proto::FrameType>(frame.type)) {
    case proto::FrameType::join_ok:
      if (join_ok_) return violation("a second join_ok");
      join_ok_ = read<proto::JoinOk>(frame).has_value();
      return;
    case proto::FrameType::error:
      return on_error_frame(frame, true);
    case proto::FrameType::chunk: {
      const auto chunk = proto::decode_chunk(frame.body);
      if (!chunk) return violation(chunk.error().detail);
      Transfer* transfer = this->transfer(chunk->header.id);
      if (transfer == nullptr) return violation("a chunk of a request that is not open");
      if (auto error = transfer->take(*chunk)) fail(std::move(*error));
      return;
    }
    case proto::FrameType::transfer_end: {
      const auto end = read<proto::TransferEnd>(frame);
      if (!end) return;
      Transfer* transfer = this->transfer(end->id);
      if (transfer == nullptr) return violation("the end of a request that is not open");
      if (auto error = transfer->finish(*end)) {
        fail(std::move(*error));
      } else if (transfer->discarded()) {
        transfers_.erase(end->id);
      }
      return;
    }
    default:
      if (const char* name = proto::type_name(frame.type)) violation(std::string(name) + " on the data channel");
  }
}

void Session::Core::on_error_frame(const proto::Frame& frame, bool on_data) {
  const auto message = read<proto::ErrorMessage>(frame);
  if (!message) return;
  if (message->id == 0 || proto::code_ends(message->code) == proto::Ends::session) {
    fail(refused(*message));
    return;
  }
  const Transfer* transfer = this->transfer(message->id);
  if (on_data || transfer == nullptr || transfer->ended()) return violation("an error for a request that is not open");
  if (transfer->started()) return violation("an error on the request channel behind a chunk");
  if (!transfer->discarded()) refusals_.emplace(message->id, refused(*message));
  awaiting_opened_.erase(message->id);
  transfers_.erase(message->id);
}

void Session::Core::on_opened(const proto::Frame& frame) {
  auto message = read<proto::MeshOpened>(frame);
  if (!message) return;
  if (awaiting_opened_.erase(message->id) == 0) return violation("mesh_opened for a request that did not ask for it");
  auto parsed = codec::parse_directory(message->directory);
  if (!parsed) return violation("the level directory of a mesh is not valid: " + parsed.error().detail);
  if (parsed->size != message->directory.size()) return violation("bytes behind the level directory of a mesh");
  if (parsed->directory.generation != message->generation) return violation("a level directory of another generation");
  if (parsed->directory.levels.empty()) return violation("a level directory without levels");
  const auto known = meshes_.find(message->handle);
  if (known != meshes_.end() && known->second.opened.generation != message->generation) {
    return violation("a handle that was given out for another generation");
  }
  if (Transfer* transfer = this->transfer(message->id)) {
    if (auto error = transfer->expect(message->handle, 0, parsed->directory.levels.front().bytes)) {
      fail(std::move(*error));
      return;
    }
  }
  opened_.emplace(message->id, OpenedMesh{message->handle, message->generation, std::move(parsed->directory),
                                          std::move(message->directory)});
}

void Session::Core::on_end(const char* channel, const std::string& why, bool broken_frames) {
  if (broken_frames) {
    return violation("what came on the " + std::string(channel) + " channel is not pmcd's protocol: " + why);
  }
  if (lost_) return;
  lost_ = Error{Failure::lost, proto::ErrorCode::none, "the " + std::string(channel) + " channel was lost: " + why};
  lost_at_ = Clock::now();
  // A channel that was never opened has no last words.
  if (!data_.socket().is_open()) data_.close();
  if (!request_.socket().is_open()) request_.close();
}

}  // namespace pmcd::client
