// SPDX-License-Identifier: MIT
// Waiting with an end, and the book of what is open in a session.
#include "client/session_core.h"

#include <algorithm>
#include <boost/asio/post.hpp>
#include <utility>

namespace pmcd::client {

using std::chrono::milliseconds;

namespace {

/// How long a lost channel waits for the other one to say why.
constexpr milliseconds kLastWords{500};

}  // namespace

std::string in_words(milliseconds time) {
  const auto ms = time.count();
  return ms % 1000 == 0 ? std::to_string(ms / 1000) + " s" : std::to_string(ms) + " ms";
}

Session::Core::Core(const Options& options) : options_(options), on_stop_(options_.stop, [this] { wake(); }) {}
Session::Core::~Core() = default;

void Session::Core::wake() {
  boost::asio::post(io_, [] {});
}

std::optional<Error> Session::Core::run(const Condition& done, Clock::time_point until) {
  while (!done()) {
    if (failure_) return failure_;
    if (options_.stop.stop_requested()) {
      request_.send_last(proto::encode(proto::Goodbye{}));
      return fail({Failure::cancelled, proto::ErrorCode::none, "stopped as asked"});
    }
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

std::optional<Error> Session::Core::wait(const Condition& done, milliseconds progress_timeout) {
  heard_at_ = progress_at_ = Clock::now();
  Clock::time_point pinged_at;
  for (;;) {
    // One ping for every half of the time-out that passes in silence.
    const auto ping_at = std::max(heard_at_, pinged_at) + options_.silence_timeout / 2;
    const auto silent_at = heard_at_ + options_.silence_timeout;
    const auto stuck_at = progress_at_ + progress_timeout;
    if (auto error = run(done, std::min({ping_at, silent_at, stuck_at}))) return error;
    if (done()) return std::nullopt;
    const auto now = Clock::now();
    if (now >= heard_at_ + options_.silence_timeout) {
      return fail({Failure::timed_out, proto::ErrorCode::none,
                   "the server has been silent for " + in_words(options_.silence_timeout)});
    }
    if (now >= progress_at_ + progress_timeout) {
      return fail({Failure::timed_out, proto::ErrorCode::none,
                   "the server is there, but sent nothing of what was asked for in " + in_words(progress_timeout)});
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

Result<std::uint32_t> Session::Core::start_request(std::uint64_t max_bytes, proto::Bytes begun) {
  const auto open = [this] {
    return std::count_if(transfers_.begin(), transfers_.end(), [](const auto& t) { return !t.second.ended(); });
  };
  if (auto error = wait([&] { return open() < hello_ok_->max_open_requests; })) return *error;
  if (failure_) return *failure_;
  const std::uint32_t id = next_id();
  transfers_.emplace(id, Transfer(id, max_bytes, std::move(begun)));
  return id;
}

Result<std::uint32_t> Session::Core::ask_for_next(Mesh& mesh) {
  if (mesh.asked) return *mesh.asked;
  const OpenedMesh& opened = mesh.opened;
  const std::size_t offset = mesh.begun.size();
  const auto id = start_request(options_.max_packet_bytes);
  if (!id) return id.error();
  *transfer(*id) = Transfer(*id, options_.max_packet_bytes, std::exchange(mesh.begun, {}));
  // Behind the last packet nothing may come: no packet has 0 bytes.
  const std::vector<codec::LevelEntry>& levels = opened.directory.levels;
  transfer(*id)->expect(opened.handle, mesh.place, mesh.place < levels.size() ? levels[mesh.place].bytes : 0);
  send_request(offset > 0 ? proto::encode(proto::GetPacket{*id, opened.generation, mesh.place, offset})
                          : proto::encode(proto::GetNextPacket{*id, opened.handle}));
  mesh.asked = *id;
  return *id;
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
    request_.send(proto::encode(proto::Cancel{id}));
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
  if (!failure_) {
    if (error.failure != Failure::violation && error.failure != Failure::limit_exceeded) save_unfinished_chunk();
    failure_ = std::move(error);
  }
  request_.close();
  data_.close();
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

}  // namespace pmcd::client
