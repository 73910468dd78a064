// SPDX-License-Identifier: MIT
// Requests of jobs, and the jobs' virtual life. A job that has all its bytes lives on in the virtual server until that
// is through with it: equal sharing would still be serving it.
#include "daemon/scheduler/rules/fsp.h"

#include <algorithm>
#include <iterator>
#include <limits>
#include <map>
#include <utility>
#include <vector>

#include "daemon/scheduler/key_map.h"
#include "daemon/scheduler/virtual_server.h"
#include "daemon/scheduler/words.h"

namespace pmcd::scheduler {
namespace {

/// Jobs that have their bytes before equal sharing would be through with them: a client may make such jobs without end,
/// by asking for the last packet of a mesh over and over.
constexpr std::size_t kMostEnded = 4'096;

class Fsp final : public Rule {
 public:
  explicit Fsp(const Surroundings& surroundings) : surroundings_(surroundings) {}

  [[nodiscard]] std::string_view name() const override { return "fsp"; }

  void enqueued(const Request& request, const Client& client, Time now) override {
    advance(now);
    Begun* begun = begun_of(request);
    const bool made = begun == nullptr;
    if (made) begun = &begin(request, client);
    const JobId job = begun->job;
    // A mesh asked for anew is a new job; a base packet that comes back to the queue is not.
    const bool anew = request.packet == 0 && begun->by != request.key;
    if (anew) server_.remove(job);
    if (made || anew) {
      begun->by = request.key;
      const auto bytes = static_cast<double>(request.remaining_bytes() + request.rest_bytes);
      server_.add(job, std::max(bytes, 1.0), cap_of(client));
    }
    std::vector<QueueOrder>& waiting = *waiting_.emplace(job).first;
    const QueueOrder order = QueueOrder::of(request);
    waiting.insert(std::upper_bound(waiting.begin(), waiting.end(), order), order);
    server_.mark(job, true);
  }

  void removed(const Request& request) override {
    const JobId job = begun_of(request)->job;
    std::vector<QueueOrder>& waiting = *waiting_.find(job);
    std::erase(waiting, QueueOrder::of(request));
    if (!waiting.empty()) return;
    waiting_.erase(job);
    server_.mark(job, false);
  }

  [[nodiscard]] std::optional<RequestKey> next() const override {
    const auto job = server_.next_marked();
    if (!job) return std::nullopt;
    return waiting_.find(*job)->front().key;
  }

  [[nodiscard]] std::vector<Ranked> ranking(std::size_t most, Time) const override {
    std::vector<VirtualServer::Finish> jobs;
    waiting_.each([this, &jobs](JobId job, const auto&) { jobs.push_back(server_.finish(job)); });
    std::sort(jobs.begin(), jobs.end());
    std::vector<Ranked> ranked;
    for (const auto& finish : jobs) {
      for (const QueueOrder& order : *waiting_.find(finish.job)) {
        if (ranked.size() == most) return ranked;
        ranked.push_back({order.key, finish.to_come ? "equal sharing would finish it in " +
                                                          seconds_text(std::max(0.0, finish.when - server_.now()))
                                                    : "equal sharing would have finished it by now"});
      }
    }
    return ranked;
  }

  void client_changed(const Client& client, std::span<const Request* const>, Time now) override {
    advance(now);
    Session* session = sessions_.find(client.session);
    if (session == nullptr) return;
    const double cap = cap_of(client);
    if (std::exchange(session->cap, cap) == cap) return;
    for (const JobId job : session->jobs) server_.set_cap(job, cap);
  }

  void finished(const Request& request, const Client&, Outcome outcome, std::span<const Request* const>,
                Time now) override {
    advance(now);
    const bool over = outcome != Outcome::requeued && request.rest_bytes == 0;
    const Begun* begun = begun_of(request);
    if (!over || begun == nullptr || waiting_.contains(begun->job)) return;
    const JobId job = begun->job;
    std::erase_if(sessions_.find(request.session)->begun, [job](const Begun& one) { return one.job == job; });
    // What was given up, equal sharing would not serve either.
    if (outcome == Outcome::failed || server_.finished(job)) {
      forget(request.session, job);
      return;
    }
    ended_.emplace(job, request.session);
    if (ended_.size() > kMostEnded) {
      const auto oldest = ended_.begin();
      forget(oldest->second, oldest->first);
      ended_.erase(oldest);
    }
  }

  void session_gone(SessionKey session, Time now) override {
    advance(now);
    Session* gone = sessions_.find(session);
    if (gone == nullptr) return;
    // Who has all its bytes may well leave; equal sharing would still be serving it, and the others no faster.
    for (const Begun& begun : gone->begun) server_.remove(begun.job);
    gone->begun.clear();
    std::erase_if(gone->jobs, [this](JobId job) { return !ended_.contains(job); });
    if (gone->jobs.empty()) sessions_.erase(session);
  }

 private:
  using JobId = VirtualServer::JobId;
  /// A job that has not got all its bytes.
  struct Begun {
    MeshKey mesh = 0;
    JobId job = 0;
    RequestKey by = 0;
  };
  struct Session {
    std::vector<Begun> begun;
    std::vector<JobId> jobs;  ///< of those, and of those that have ended; ascending
    double cap = 0;           ///< of each of them
  };

  [[nodiscard]] Begun* begun_of(const Request& request) {
    Session* session = sessions_.find(request.session);
    if (session == nullptr) return nullptr;
    const auto it = std::find_if(session->begun.begin(), session->begun.end(),
                                 [&request](const Begun& one) { return one.mesh == request.mesh; });
    return it == session->begun.end() ? nullptr : &*it;
  }
  Begun& begin(const Request& request, const Client& client) {
    Session& session = *sessions_.emplace(request.session).first;
    session.cap = cap_of(client);
    session.jobs.push_back(next_id_);
    return session.begun.emplace_back(Begun{request.mesh, next_id_++, request.key});
  }

  void advance(Time now) {
    double capacity = surroundings_.uplink;
    if (capacity <= 0) capacity = surroundings_.clients.median_speed().value_or(kUnknownUplink);
    server_.advance(std::chrono::duration<double>(now).count());
    server_.set_capacity(capacity);
    // What has its bytes is of no interest once equal sharing is through with it too.
    if (ended_.size() < 2 * kept_) return;
    for (auto it = ended_.begin(); it != ended_.end();) {
      const auto [job, session] = *it;
      it = server_.finished(job) ? ended_.erase(it) : std::next(it);
      if (server_.finished(job)) forget(session, job);
    }
    kept_ = std::max<std::size_t>(ended_.size(), 16);
  }

  void forget(SessionKey session, JobId job) {
    server_.remove(job);
    std::vector<JobId>& jobs = sessions_.find(session)->jobs;
    std::erase(jobs, job);
    if (jobs.empty()) sessions_.erase(session);
  }

  static double cap_of(const Client& client) { return client.speed.value_or(std::numeric_limits<double>::infinity()); }

  const Surroundings& surroundings_;
  VirtualServer server_;
  KeyMap<Session> sessions_;
  KeyMap<std::vector<QueueOrder>> waiting_;  ///< of each job, ascending
  std::map<JobId, SessionKey> ended_;        ///< have all their bytes, and were not through in the virtual server
  std::size_t kept_ = 16;                    ///< of ended_, when it was cleared last
  JobId next_id_ = 1;
};

}  // namespace

std::unique_ptr<Rule> make_fsp(const Surroundings& surroundings) {
  return std::make_unique<Fsp>(surroundings);
}

}  // namespace pmcd::scheduler
