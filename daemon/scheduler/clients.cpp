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
  const Record* record = find_record(session);
  return record == nullptr ? nullptr : &record->client;
}

const Clients::Record* Clients::find_record(SessionKey session) const {
  const auto* record = records_.find(session);
  return record == nullptr ? nullptr : record->get();
}

Clients::Record& Clients::record(SessionKey session) {
  const auto [record, made] = records_.emplace(session);
  if (made) {
    *record = std::make_unique<Record>();
    (*record)->client.session = session;
  }
  return **record;
}

void Clients::forget(SessionKey session) {
  const Record* record = find_record(session);
  if (record == nullptr) return;
  discount(*record);
  records_.erase(session);
}

void Clients::count(const Record& record) {
  if (!record.client.speed) return;
  if (all_) all_->insert(*record.client.speed);
  if (active_ && record.active) active_->insert(*record.client.speed);
}

void Clients::discount(const Record& record) {
  if (!record.client.speed) return;
  if (all_) all_->erase(*record.client.speed);
  if (active_ && record.active) active_->erase(*record.client.speed);
}

std::optional<double> Clients::median_speed() const {
  if (!all_) {
    all_.emplace();
    records_.each([this](SessionKey, const auto& record) {
      if (record->client.speed) all_->insert(*record->client.speed);
    });
  }
  return all_->median();
}

std::optional<double> Clients::median_active_speed() const {
  if (!active_) {
    active_.emplace();
    records_.each([this](SessionKey, const auto& record) {
      if (record->active && record->client.speed) active_->insert(*record->client.speed);
    });
  }
  return active_->median();
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
  const Record* record = find_record(session);
  return record == nullptr ? 0 : record->rate.rate(now);
}

std::optional<double> Clients::guessed_speed(SessionKey session) const {
  const Record* record = find_record(session);
  return record == nullptr ? std::nullopt : record->meter.guess();
}

}  // namespace pmcd::scheduler
