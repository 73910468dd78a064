// SPDX-License-Identifier: MIT
// Bookkeeping of the request queue: who waits, who runs, what the rule has been told. It decides nothing itself.
#include "daemon/scheduler/scheduler.h"

#include <algorithm>
#include <utility>

namespace pmcd::scheduler {

Scheduler::Scheduler(std::unique_ptr<Rule> rule, std::size_t slots) : rule_(std::move(rule)), slots_(slots) {}

bool Scheduler::enqueue(Request request) {
  request.queued_at = request.asked_at;
  const auto [it, inserted] = requests_.try_emplace(request.key, Entry{request, false});
  if (!inserted) return false;
  by_session_[request.session].push_back(request.key);
  rule_->enqueued(it->second.request);
  return true;
}

bool Scheduler::withdraw(RequestKey key) {
  const auto it = requests_.find(key);
  if (it == requests_.end() || it->second.running) return false;
  rule_->removed(it->second.request);
  forget(it);
  return true;
}

std::optional<Request> Scheduler::take(Time now) {
  if (running_ >= slots_) return std::nullopt;
  const std::optional<RequestKey> key = rule_->next();
  if (!key) return std::nullopt;
  Entry& entry = requests_.at(*key);
  rule_->removed(entry.request);
  entry.running = true;
  ++running_;
  rule_->started(entry.request, now);
  return entry.request;
}

void Scheduler::progressed(RequestKey key, std::uint64_t bytes, Time now) {
  const auto it = find_running(key);
  if (it != requests_.end()) rule_->progressed(it->second.request, bytes, now);
}

bool Scheduler::complete(RequestKey key, Time now) {
  return finish(key, Outcome::complete, now);
}

bool Scheduler::fail(RequestKey key, Time now) {
  return finish(key, Outcome::failed, now);
}

bool Scheduler::requeue(RequestKey key, std::uint64_t offset_bytes, Time now) {
  const auto it = find_running(key);
  if (it == requests_.end()) return false;
  Entry& entry = it->second;
  if (offset_bytes >= entry.request.size_bytes) return false;
  rule_->finished(entry.request, Outcome::requeued, now);
  --running_;
  entry.running = false;
  entry.request.offset_bytes = offset_bytes;
  entry.request.queued_at = now;
  rule_->enqueued(entry.request);
  return true;
}

std::vector<RequestKey> Scheduler::remove_session(SessionKey session, Time now) {
  std::vector<RequestKey> keys;
  if (auto node = by_session_.extract(session); !node.empty()) keys = std::move(node.mapped());
  for (const RequestKey key : keys) {
    const auto it = requests_.find(key);
    if (it->second.running) {
      --running_;
      rule_->finished(it->second.request, Outcome::failed, now);
    } else {
      rule_->removed(it->second.request);
    }
    requests_.erase(it);
  }
  rule_->session_gone(session, now);
  std::sort(keys.begin(), keys.end());
  return keys;
}

bool Scheduler::finish(RequestKey key, Outcome outcome, Time now) {
  const auto it = find_running(key);
  if (it == requests_.end()) return false;
  rule_->finished(it->second.request, outcome, now);
  --running_;
  forget(it);
  return true;
}

Scheduler::Entries::iterator Scheduler::find_running(RequestKey key) {
  const auto it = requests_.find(key);
  return it != requests_.end() && it->second.running ? it : requests_.end();
}

void Scheduler::forget(Entries::iterator it) {
  const auto session = by_session_.find(it->second.request.session);
  std::erase(session->second, it->first);
  if (session->second.empty()) by_session_.erase(session);
  requests_.erase(it);
}

}  // namespace pmcd::scheduler
