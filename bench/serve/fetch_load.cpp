// SPDX-License-Identifier: MIT
// The load for throughput: an epoll loop over sessions that send the next request as soon as one is answered.
#include <sys/epoll.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <map>
#include <memory>
#include <string>
#include <utility>

#include "bench/serve/data_stream.h"
#include "bench/serve/figures.h"
#include "bench/serve/link.h"
#include "bench/serve/loads.h"
#include "codec/packet/directory.h"
#include "codec/packet/header.h"

namespace pmcd::bench {
namespace {

constexpr std::size_t kReceiveBuffer = 256 * 1024;
constexpr std::size_t kCheckEvery = 64;

struct Totals {
  std::uint64_t requests = 0;
  std::uint64_t bytes = 0;
  std::uint64_t rounds = 0;   ///< meshes fetched to their end
  std::uint64_t checked = 0;  ///< packets whose checksums were compared
  std::vector<float> latency_us;
};

/// Directories by generation, shared by the sessions.
using Directories = std::map<std::uint64_t, codec::Directory>;

class FetchSession {
 public:
  FetchSession(const FetchOptions& options, std::size_t number, Directories& directories, Totals& totals)
      : options_(options),
        mesh_(options.meshes[number % options.meshes.size()]),
        directories_(directories),
        totals_(totals) {
    OpenSession session = open_session(options.port, number);
    requests_ = std::move(session.requests);
    data_ = std::move(session.data.socket());
    requests_.socket().set_non_blocking();
    data_.set_non_blocking();
  }

  [[nodiscard]] int request_fd() { return requests_.socket().fd(); }
  [[nodiscard]] int data_fd() const { return data_.fd(); }

  /// Asks for the base mesh and for as many packets behind it as may be open.
  void begin_round() {
    proto::GetBaseMesh message;
    message.id = note_request();
    message.name = mesh_;
    requests_.socket().send(proto::encode(message));
    expected_packet_ = 0;
    ended_ = false;
    while (in_flight_ < options_.open) ask_next();
  }

  void on_requests_readable(std::vector<std::byte>& buffer) {
    while (const auto frame = requests_.next(buffer)) {
      const auto opened = expect<proto::MeshOpened>(frame);
      auto found = directories_.find(opened.generation);
      if (found == directories_.end()) {
        auto parsed = codec::parse_directory(opened.directory);
        if (!parsed) fail("the directory of " + mesh_ + ": " + parsed.error().detail);
        found = directories_.emplace(opened.generation, std::move(parsed.value().directory)).first;
      }
      directory_ = &found->second;
    }
    if (requests_.at_end()) fail("the daemon closed a request channel");
  }

  void on_data_readable(std::vector<std::byte>& buffer) {
    const auto count = data_.receive(buffer);
    if (!count) return;
    if (*count == 0) fail("the daemon closed a data channel");
    stream_.feed(
        proto::ByteView(buffer).first(*count),
        [this](const proto::ChunkHeader& chunk, proto::ByteView piece) { on_piece(chunk, piece); },
        [this](const proto::Frame& frame) { on_end(expect<proto::TransferEnd>(frame)); });
  }

 private:
  struct InFlight {
    std::uint32_t id = 0;
    Clock::time_point asked_at;
  };

  std::uint32_t note_request() {
    InFlight& request = line_[(first_ + in_flight_++) % line_.size()];
    request.id = ++last_id_;
    request.asked_at = Clock::now();
    return request.id;
  }

  void ask_next() {
    // Handle 0 is the mesh last asked for, so mesh_opened need not be awaited.
    requests_.socket().send(proto::encode(proto::GetNextPacket{note_request(), 0}));
  }

  void on_piece(const proto::ChunkHeader& chunk, proto::ByteView piece) {
    if (chunk.id != line_[first_].id || chunk.packet != expected_packet_ || chunk.offset != received_ ||
        chunk.total != options_.packet_bytes) {
      fail("a chunk of packet " + std::to_string(chunk.packet) + " at " + std::to_string(chunk.offset) + " of " +
           std::to_string(chunk.total) + ", expected packet " + std::to_string(expected_packet_) + " at " +
           std::to_string(received_) + " of " + std::to_string(options_.packet_bytes));
    }
    received_ += piece.size();
    if (sampled_) sample_.insert(sample_.end(), piece.begin(), piece.end());
  }

  void on_end(const proto::TransferEnd& end) {
    const InFlight request = line_[first_];
    if (in_flight_ == 0 || end.id != request.id) fail("request " + std::to_string(end.id) + " ended out of order");
    first_ = (first_ + 1) % line_.size();
    --in_flight_;
    if (end.result == proto::TransferResult::complete) {
      complete(request);
    } else if (end.result == proto::TransferResult::end_of_mesh && received_ == 0) {
      ended_ = true;
    } else {
      fail(std::string("a transfer ended by ") + proto::result_name(end.result));
    }
    if (!ended_) {
      ask_next();
    } else if (in_flight_ == 0) {
      ++totals_.rounds;
      begin_round();
    }
  }

  void complete(const InFlight& request) {
    if (received_ != options_.packet_bytes) fail("a packet ended after " + std::to_string(received_) + " bytes");
    ++totals_.requests;
    totals_.bytes += received_;
    totals_.latency_us.push_back(std::chrono::duration<float, std::micro>(Clock::now() - request.asked_at).count());
    if (sampled_) check_sample();
    ++expected_packet_;
    received_ = 0;
    // Prime to the number of packets in most meshes, so every packet comes into the sample some time.
    sampled_ = directory_ != nullptr && ++since_sample_ % (kCheckEvery + 1) == 0;
  }

  void check_sample() {
    const auto header = codec::check_packet(sample_);
    if (!header) fail("packet " + std::to_string(expected_packet_) + ": " + header.error().detail);
    if (header.value().crc32c != directory_->levels.at(expected_packet_).crc32c) {
      fail("packet " + std::to_string(expected_packet_) + " is not the one that the directory announces");
    }
    ++totals_.checked;
    sample_.clear();
  }

  const FetchOptions& options_;
  const std::string& mesh_;
  Directories& directories_;
  Totals& totals_;
  Link requests_;
  Socket data_;
  DataStream stream_;
  const codec::Directory* directory_ = nullptr;
  std::array<InFlight, proto::kMaxOpenRequests> line_{};  ///< a ring of open requests, answered in this order
  std::size_t first_ = 0;
  std::size_t in_flight_ = 0;
  std::uint32_t last_id_ = 0;
  bool ended_ = false;
  std::uint32_t expected_packet_ = 0;
  std::uint64_t received_ = 0;  ///< of that packet
  std::size_t since_sample_ = 0;
  bool sampled_ = false;
  std::vector<std::byte> sample_;
};

}  // namespace

nlohmann::json fetch_load(const FetchOptions& options) {
  const Socket events(::epoll_create1(EPOLL_CLOEXEC));
  const auto watch = [&events](int fd, std::size_t key) {
    epoll_event event{};
    event.events = EPOLLIN;
    event.data.u64 = key;
    if (::epoll_ctl(events.fd(), EPOLL_CTL_ADD, fd, &event) != 0)
      fail(std::string("epoll_ctl: ") + std::strerror(errno));
  };
  Directories directories;
  Totals totals;
  std::vector<std::unique_ptr<FetchSession>> sessions;
  for (std::size_t number = 0; number < options.sessions; ++number) {
    sessions.push_back(std::make_unique<FetchSession>(options, number, directories, totals));
    watch(sessions.back()->request_fd(), 2 * number);
    watch(sessions.back()->data_fd(), 2 * number + 1);
  }

  std::vector<std::byte> buffer(kReceiveBuffer);
  std::array<epoll_event, 256> ready{};
  const double cpu_before = seconds_of_cpu();
  const Clock::time_point start = Clock::now();
  const Clock::time_point deadline =
      start + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(options.seconds));
  for (const auto& session : sessions) session->begin_round();
  while (Clock::now() < deadline) {
    const int count = ::epoll_wait(events.fd(), ready.data(), static_cast<int>(ready.size()), 1000);
    if (count < 0 && errno != EINTR) fail(std::string("epoll_wait: ") + std::strerror(errno));
    for (int i = 0; i < count; ++i) {
      const std::uint64_t key = ready[static_cast<std::size_t>(i)].data.u64;
      FetchSession& session = *sessions[key / 2];
      key % 2 == 0 ? session.on_requests_readable(buffer) : session.on_data_readable(buffer);
    }
  }
  const double seconds = std::chrono::duration<double>(Clock::now() - start).count();
  const double cpu = seconds_of_cpu() - cpu_before;
  return {{"seconds", seconds},
          {"requests", totals.requests},
          {"bytes", totals.bytes},
          {"rounds", totals.rounds},
          {"checked", totals.checked},
          {"cpu_seconds", cpu},
          {"latency_us", percentiles(totals.latency_us)}};
}

}  // namespace pmcd::bench
