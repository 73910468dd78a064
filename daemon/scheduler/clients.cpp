// SPDX-License-Identifier: MIT
// Bookkeeping of clients, and a median of two halves.
#include "daemon/scheduler/clients.h"

#include <algorithm>
#include <cmath>

namespace pmcd::scheduler {
namespace {

/// A speed that has changed by less than this part of it has not changed: keys need not follow each flutter.
constexpr double kNotable = 0.02;

}  // namespace

void RunningMedian::insert(double value) {
  (low_.empty() || value <= low_.back() ? low_ : high_).insert(value);
  balance();
}

void RunningMedian::erase(double value) {
  if (!low_.erase(value)) high_.erase(value);
  balance();
}

void RunningMedian::balance() {
  if (low_.size() > high_.size() + 1) {
    const double last = low_.back();
    high_.insert(last);
    low_.erase(last);
  } else if (high_.size() > low_.size()) {
    const double first = high_.front();
    low_.insert(first);
    high_.erase(first);
  }
}

std::optional<double> RunningMedian::median() const {
  if (low_.empty()) return std::nullopt;
  return low_.back();
}

const Client* Clients::find(SessionKey session) const {
  const auto it = records_.find(session);
  return it == records_.end() ? nullptr : &it->second.client;
}

Clients::Record& Clients::record(SessionKey session) {
  const auto [it, made] = records_.try_emplace(session);
  if (made) it->second.client.session = session;
  return it->second;
}

void Clients::forget(SessionKey session) {
  const auto it = records_.find(session);
  if (it == records_.end()) return;
  discount(it->second);
  records_.erase(it);
}

void Clients::count(const Record& record) {
  if (!record.client.speed) return;
  all_.insert(*record.client.speed);
  if (record.active) active_.insert(*record.client.speed);
}

void Clients::discount(const Record& record) {
  if (!record.client.speed) return;
  all_.erase(*record.client.speed);
  if (record.active) active_.erase(*record.client.speed);
}

bool Clients::observe(SessionKey session, const SpeedSample& sample) {
  Record& record = this->record(session);
  record.meter.note(sample);
  const std::uint64_t bytes = sample.acknowledged - std::min(record.position, sample.acknowledged);
  record.position = std::max(record.position, sample.acknowledged);
  record.rate.note(bytes, sample.now);
  rate_.note(bytes, sample.now);
  const auto speed = record.meter.speed();
  if (!speed) return false;
  const auto before = record.client.speed;
  if (before && std::abs(*speed - *before) <= kNotable * *before) return false;
  discount(record);
  record.client.speed = speed;
  count(record);
  return true;
}

bool Clients::acknowledged(SessionKey session, std::uint64_t payload_bytes) {
  record(session).client.acknowledged += payload_bytes;
  return payload_bytes > 0;
}

bool Clients::set_weight(SessionKey session, double weight) {
  Client& client = record(session).client;
  const bool changed = client.weight != weight;
  client.weight = weight;
  return changed;
}

void Clients::set_active(SessionKey session, bool active) {
  Record& record = this->record(session);
  if (record.active == active) return;
  discount(record);
  record.active = active;
  count(record);
}

double Clients::taking(SessionKey session, Time now) const {
  const auto it = records_.find(session);
  return it == records_.end() ? 0 : it->second.rate.rate(now);
}

std::optional<double> Clients::guessed_speed(SessionKey session) const {
  const auto it = records_.find(session);
  return it == records_.end() ? std::nullopt : it->second.meter.guess();
}

}  // namespace pmcd::scheduler
