// SPDX-License-Identifier: MIT
// Requests of jobs, and the jobs' virtual life. A job that has all its bytes lives on in the virtual server until that
// is through with it: equal sharing would still be serving it.
#include "daemon/scheduler/rules/fsp.h"

#include <algorithm>
#include <iterator>
#include <limits>
#include <map>
#include <set>
#include <unordered_map>
#include <utility>

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
    const auto [it, made] = jobs_.try_emplace({request.session, request.mesh}, Begun{next_id_, request.key});
    auto& [job, begun_by] = it->second;
    if (made) {
      ++next_id_;
      by_session_[request.session].insert(job);
    }
    // A mesh asked for anew is a new job; a base packet that comes back to the queue is not.
    const bool anew = request.packet == 0 && begun_by != request.key;
    if (anew) server_.remove(job);
    if (made || anew) {
      begun_by = request.key;
      const auto bytes = static_cast<double>(request.remaining_bytes() + request.rest_bytes);
      server_.add(job, std::max(bytes, 1.0), cap_of(client));
    }
    waiting_[job].insert(QueueOrder::of(request));
    server_.mark(job, true);
  }

  void removed(const Request& request) override {
    const JobId job = jobs_.at({request.session, request.mesh}).job;
    const auto it = waiting_.find(job);
    it->second.erase(QueueOrder::of(request));
    if (!it->second.empty()) return;
    waiting_.erase(it);
    server_.mark(job, false);
  }

  [[nodiscard]] std::optional<RequestKey> next() const override {
    const auto job = server_.next_marked();
    if (!job) return std::nullopt;
    return waiting_.at(*job).begin()->key;
  }

  [[nodiscard]] std::vector<Ranked> ranking(std::size_t most, Time) const override {
    std::vector<VirtualServer::Finish> jobs;
    for (const auto& [job, requests] : waiting_) jobs.push_back(server_.finish(job));
    std::sort(jobs.begin(), jobs.end());
    std::vector<Ranked> ranked;
    for (const auto& finish : jobs) {
      for (const QueueOrder& order : waiting_.at(finish.job)) {
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
    const auto jobs = by_session_.find(client.session);
    if (jobs == by_session_.end()) return;
    for (const JobId job : jobs->second) server_.set_cap(job, cap_of(client));
  }

  void finished(const Request& request, const Client&, Outcome outcome, std::span<const Request* const>,
                Time now) override {
    advance(now);
    const bool over = outcome != Outcome::requeued && request.rest_bytes == 0;
    const auto it = jobs_.find({request.session, request.mesh});
    if (!over || it == jobs_.end() || waiting_.contains(it->second.job)) return;
    const JobId job = it->second.job;
    jobs_.erase(it);
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
    jobs_.erase(jobs_.lower_bound({session, 0}), jobs_.upper_bound({session, std::numeric_limits<MeshKey>::max()}));
    const auto jobs = by_session_.find(session);
    if (jobs == by_session_.end()) return;
    // Who has all its bytes may well leave; equal sharing would still be serving it, and the others no faster.
    for (auto it = jobs->second.begin(); it != jobs->second.end();) {
      const JobId job = *it;
      it = ended_.contains(job) ? std::next(it) : jobs->second.erase(it);
      if (!ended_.contains(job)) server_.remove(job);
    }
    if (jobs->second.empty()) by_session_.erase(jobs);
  }

 private:
  using JobId = VirtualServer::JobId;
  struct Begun {
    JobId job = 0;
    RequestKey by = 0;
  };

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
    const auto jobs = by_session_.find(session);
    jobs->second.erase(job);
    if (jobs->second.empty()) by_session_.erase(jobs);
  }

  static double cap_of(const Client& client) { return client.speed.value_or(std::numeric_limits<double>::infinity()); }

  const Surroundings& surroundings_;
  VirtualServer server_;
  std::map<std::pair<SessionKey, MeshKey>, Begun> jobs_;  ///< that have not got all their bytes
  std::unordered_map<SessionKey, std::set<JobId>> by_session_;
  std::unordered_map<JobId, std::set<QueueOrder>> waiting_;
  std::map<JobId, SessionKey> ended_;  ///< have all their bytes, and were not through in the virtual server
  std::size_t kept_ = 16;              ///< of ended_, when it was cleared last
  JobId next_id_ = 1;
};

}  // namespace

std::unique_ptr<Rule> make_fsp(const Surroundings& surroundings) {
  return std::make_unique<Fsp>(surroundings);
}

}  // namespace pmcd::scheduler
