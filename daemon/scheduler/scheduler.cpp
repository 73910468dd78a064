// SPDX-License-Identifier: MIT
// Bookkeeping of the request queue: who waits, who runs, what the rule has been told. Which of those that wait goes
// next is the rule's to say, or that of a request's age; how many may run, the policy's.
#include "daemon/scheduler/scheduler.h"

#include <algorithm>
#include <set>
#include <utility>

namespace pmcd::scheduler {
namespace {

/// Of what the uplink carries, so much is payload that the speeds of clients show when it is full: headers, and the
/// flutter of short measurements, are the rest. What they take of it together is less while several share it, and as
/// long as that is not called full, more and more of them share it, until each is measured to be slow.
constexpr double kFull = 0.85;
constexpr double kTaken = 0.75;
/// Of a measured uplink: it may be more than what was seen of it, and only trying tells.
constexpr double kTry = 1.06;
/// Transfers at a time as long as nothing is known of the uplink.
constexpr std::size_t kSlotsBeforeMeasured = 4;

}  // namespace

Scheduler::Scheduler(Policy policy) : policy_(std::move(policy)) {
  note_uplink();
  rule_ = make_rule(policy_.rule, policy_.rule_options, surroundings_);
}

void Scheduler::note_uplink() {
  surroundings_.uplink = policy_.uplink > 0 ? policy_.uplink : uplink_meter_.capacity().value_or(0);
}

bool Scheduler::enqueue(Request request, Time now) {
  request.queued_at = request.asked_at;
  const RequestKey key = request.key;
  const auto [place, is_new] = requests_.emplace(key);
  if (!is_new) return false;
  const SessionKey session = request.session;
  *place = std::make_unique<Entry>(Entry{std::move(request), clients_.of(session)});
  Entry& entry = **place;
  std::vector<Entry*>& entries = *by_session_.emplace(session).first;
  entries.push_back(&entry);
  if (entries.size() == 1) clients_.set_active(session, true);
  join(entry, now);
  return true;
}

bool Scheduler::is_to_be_held(const Request& request) const {
  if (policy_.slots) return false;
  const auto entries = entries_of(request.session);
  return std::any_of(entries.begin(), entries.end(), [](const Entry* one) { return one->state == State::running; });
}

void Scheduler::hold_or_release(SessionKey session, Time now) {
  if (policy_.slots) return;
  for (Entry* entry : entries_of(session)) {
    if (entry->state != State::waiting && entry->state != State::held) continue;
    const bool hold = is_to_be_held(entry->request);
    if (hold == (entry->state == State::held)) continue;
    if (hold) {
      leave(*entry);
      entry->state = State::held;
    } else {
      join(*entry, now);
    }
  }
}

bool Scheduler::is_held(RequestKey key) const {
  const Entry* entry = entry_of(key);
  return entry != nullptr && entry->state == State::held;
}

void Scheduler::join(Entry& entry, Time now) {
  if (is_to_be_held(entry.request)) {
    entry.state = State::held;
    return;
  }
  entry.state = State::waiting;
  ++in_sight_;
  if (policy_.aging) ages_.insert(age_of(entry.request));
  rule_->enqueued(entry.request, entry.client, now);
}

void Scheduler::leave(Entry& entry) {
  --in_sight_;
  if (policy_.aging) ages_.erase(age_of(entry.request));
  rule_->removed(entry.request);
}

void Scheduler::start(Entry& entry, Time now) {
  leave(entry);
  entry.state = State::running;
  entry.turn_since = now;
  ++running_;
  serve_since(entry, now);
  rule_->started(entry.request, entry.client, now);
  hold_or_release(entry.request.session, now);
}

void Scheduler::serve_since(Entry& entry, Time since) {
  entry.slot_since = since;
  if (!policy_.slots) load_.served_since(entry.request.key, entry.request.session, since);
}

void Scheduler::stop(Entry& entry, Outcome outcome, Time now) {
  --running_;
  load_.ends(entry.request.key);
  entry.state = State::parked;  // out of the rule's sight until it joins again, or for good
  hold_or_release(entry.request.session, now);
  rule_->finished(entry.request, entry.client, outcome, waiting_of(entry.request.session), now);
}

bool Scheduler::withdraw(RequestKey key) {
  Entry* entry = entry_of(key);
  if (entry == nullptr || entry->state == State::running) return false;
  if (entry->state == State::waiting) leave(*entry);
  forget(*entry);
  return true;
}

std::optional<RequestKey> Scheduler::next(Time now) const {
  if (policy_.aging && !ages_.empty() && now - ages_.front().first > *policy_.aging) return ages_.front().second.key;
  return rule_->next();
}

std::optional<RequestKey> Scheduler::due(Time now, std::size_t taken_slots) const {
  if (!has_slot(now, taken_slots)) return std::nullopt;
  return next(now);
}

Request Scheduler::begin(RequestKey key, Time now) {
  Entry& entry = *entry_of(key);
  start(entry, now);
  return entry.request;
}

std::optional<Request> Scheduler::take(Time now, std::size_t taken_slots) {
  const std::optional<RequestKey> key = due(now, taken_slots);
  if (!key) return std::nullopt;
  return begin(*key, now);
}

bool Scheduler::has_slot(Time now, std::size_t taken_slots) const {
  const std::size_t taken = running_ + taken_slots;
  if (policy_.slots) return taken < *policy_.slots;
  if (taken == 0) return true;
  if (taken >= kMaxSlots) return false;
  if (surroundings_.uplink <= 0) return taken < kSlotsBeforeMeasured;
  double full = (policy_.uplink > 0 ? kFull : kTry) * surroundings_.uplink;
  if (is_uplink_taken(now)) {
    // What was taken of late may have been another's, who is through: one that is alone now may be slow.
    if (taken > 1) return false;
    full = kMayFill * surroundings_.uplink;
  }
  return load_.sum(now) < full;
}

bool Scheduler::has_others(SessionKey session) const {
  std::size_t own = 0;
  for (const Entry* entry : entries_of(session)) {
    if (entry->state == State::running || entry->state == State::waiting) ++own;
  }
  return in_sight_ + running_ > own;
}

bool Scheduler::is_uplink_taken(Time now) const {
  return !policy_.slots && surroundings_.uplink > 0 &&
         clients_.taking(now) >= (policy_.uplink > 0 ? kTaken : kTry) * surroundings_.uplink;
}

bool Scheduler::has_rivals(Time now) const {
  if (in_sight_ > 0) return true;
  // Where the uplink is full with several at a time, each of them may fill it alone: then the rule is to say who.
  return running_ > 1 && is_uplink_taken(now);
}

void Scheduler::observe(SessionKey session, const SpeedSample& sample, Time now) {
  const bool has_changed = clients_.observe(session, sample);
  if (!policy_.slots) {
    for (const Entry* entry : entries_of(session)) load_.observed(entry->request.key, now);
  }
  if (has_changed) client_changed(session, now);
}

void Scheduler::acknowledged(SessionKey session, std::uint64_t payload_bytes, Time now) {
  uplink_meter_.note(payload_bytes, now);
  note_uplink();
  if (clients_.acknowledged(session, payload_bytes)) client_changed(session, now);
}

void Scheduler::set_weight(SessionKey session, double weight, Time now) {
  if (clients_.set_weight(session, weight)) client_changed(session, now);
}

std::vector<const Request*> Scheduler::waiting_of(SessionKey session) const {
  std::vector<const Request*> waiting;
  for (const Entry* entry : entries_of(session)) {
    if (entry->state == State::waiting) waiting.push_back(&entry->request);
  }
  return waiting;
}

void Scheduler::client_changed(SessionKey session, Time now) {
  rule_->client_changed(*clients_.find(session), waiting_of(session), now);
}

bool Scheduler::complete(RequestKey key, Time now) {
  return finish(key, Outcome::complete, now);
}

bool Scheduler::fail(RequestKey key, std::uint64_t offset_bytes, Time now) {
  Entry* entry = find_running(key);
  if (entry == nullptr) return false;
  entry->request.offset_bytes = std::min(offset_bytes, entry->request.size_bytes);
  return finish(key, Outcome::failed, now);
}

bool Scheduler::requeue(RequestKey key, std::uint64_t offset_bytes, Time now) {
  Entry* entry = find_running(key);
  if (entry == nullptr || offset_bytes >= entry->request.size_bytes) return false;
  entry->request.offset_bytes = offset_bytes;
  stop(*entry, Outcome::requeued, now);
  entry->request.queued_at = now;
  join(*entry, now);
  return true;
}

void Scheduler::turn_begins(RequestKey key, Time now) {
  Entry* entry = find_running(key);
  if (entry == nullptr) return;
  if (entry->slot_since == entry->turn_since) serve_since(*entry, now);
  entry->turn_since = now;
}

bool Scheduler::quantum_is_over(RequestKey key, Time now) const {
  const Entry* entry = find_running(key);
  return entry != nullptr && policy_.quantum && now - entry->turn_since >= *policy_.quantum && has_rivals(now);
}

bool Scheduler::yield(RequestKey key, std::uint64_t offset_bytes, Time now, std::size_t taken_slots) {
  Entry* entry = find_running(key);
  if (entry == nullptr) return false;
  const Time slot_since = entry->slot_since;
  if (!requeue(key, offset_bytes, now)) return true;
  // Who takes nothing would be the next again and again, for the speed that it once had.
  const bool takes = now - slot_since < RecentRate::kSpan || clients_.taking(entry->request.session, now) > 0;
  if (!takes || !has_slot(now, taken_slots) || next(now) != key) return false;
  start(*entry, now);
  serve_since(*entry, slot_since);
  return true;
}

void Scheduler::park(RequestKey key) {
  Entry* entry = entry_of(key);
  if (entry == nullptr || (entry->state != State::waiting && entry->state != State::held)) return;
  if (entry->state == State::waiting) leave(*entry);
  entry->state = State::parked;
}

void Scheduler::unpark(RequestKey key, Time now) {
  Entry* entry = entry_of(key);
  if (entry != nullptr && entry->state == State::parked) join(*entry, now);
}

std::vector<RequestKey> Scheduler::remove_session(SessionKey session, Time now) {
  std::vector<RequestKey> keys;
  for (const Entry* entry : entries_of(session)) keys.push_back(entry->request.key);
  for (const RequestKey key : keys) {
    Entry& entry = *entry_of(key);
    if (entry.state == State::waiting) leave(entry);
    if (entry.state == State::running) stop(entry, Outcome::failed, now);
    forget(entry);
  }
  by_session_.erase(session);
  rule_->session_gone(session, now);
  clients_.forget(session);
  std::sort(keys.begin(), keys.end());
  return keys;
}

void Scheduler::switch_to(Policy policy, Time now) {
  policy_ = std::move(policy);
  note_uplink();
  rule_ = make_rule(policy_.rule, policy_.rule_options, surroundings_);
  load_.clear();
  ages_ = {};
  in_sight_ = 0;
  // In the order in which they came, as the rule would have heard of them.
  std::vector<Entry*> entries;
  requests_.each([&entries](RequestKey, const std::unique_ptr<Entry>& entry) {
    if (entry->state != State::parked) entries.push_back(entry.get());
  });
  std::sort(entries.begin(), entries.end(),
            [](const Entry* a, const Entry* b) { return QueueOrder::of(a->request) < QueueOrder::of(b->request); });
  for (Entry* entry : entries) {
    if (entry->state != State::running) {
      join(*entry, now);
      continue;
    }
    rule_->enqueued(entry->request, entry->client, now);
    rule_->removed(entry->request);
    rule_->started(entry->request, entry->client, now);
    serve_since(*entry, entry->slot_since);
  }
}

std::vector<Ranked> Scheduler::ranking(std::size_t most, Time now) const {
  if (!policy_.aging || ages_.empty() || now - ages_.front().first <= *policy_.aging) {
    return rule_->ranking(most, now);
  }
  std::vector<Ranked> ranked;
  std::set<RequestKey> aged;
  ages_.each([&](const Age& age) {
    if (now - age.first <= *policy_.aging) return false;
    aged.insert(age.second.key);
    if (ranked.size() < most) ranked.push_back({age.second.key, "older than the policy's aging"});
    return true;
  });
  for (Ranked& one : rule_->ranking(ages_.size(), now)) {
    if (ranked.size() >= most) break;
    if (!aged.contains(one.key)) ranked.push_back(std::move(one));
  }
  return ranked;
}

const Request* Scheduler::find(RequestKey key) const {
  const Entry* entry = entry_of(key);
  return entry == nullptr ? nullptr : &entry->request;
}

std::pair<std::size_t, std::size_t> Scheduler::counts(SessionKey session) const {
  const auto entries = entries_of(session);
  const auto running = static_cast<std::size_t>(
      std::count_if(entries.begin(), entries.end(), [](const Entry* one) { return one->state == State::running; }));
  return {entries.size() - running, running};
}

bool Scheduler::finish(RequestKey key, Outcome outcome, Time now) {
  Entry* entry = find_running(key);
  if (entry == nullptr) return false;
  if (outcome == Outcome::complete) entry->request.offset_bytes = entry->request.size_bytes;
  stop(*entry, outcome, now);
  forget(*entry);
  return true;
}

Scheduler::Entry* Scheduler::entry_of(RequestKey key) const {
  const auto* entry = requests_.find(key);
  return entry == nullptr ? nullptr : entry->get();
}

Scheduler::Entry* Scheduler::find_running(RequestKey key) const {
  Entry* entry = entry_of(key);
  return entry != nullptr && entry->state == State::running ? entry : nullptr;
}

std::span<Scheduler::Entry* const> Scheduler::entries_of(SessionKey session) const {
  const auto* entries = by_session_.find(session);
  return entries == nullptr ? std::span<Entry* const>() : *entries;
}

void Scheduler::forget(const Entry& entry) {
  const SessionKey session = entry.request.session;
  std::vector<Entry*>& entries = *by_session_.find(session);
  std::erase(entries, &entry);
  if (entries.empty()) clients_.set_active(session, false);
  requests_.erase(entry.request.key);
}

}  // namespace pmcd::scheduler
