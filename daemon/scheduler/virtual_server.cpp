// SPDX-License-Identifier: MIT
// Max-min sharing in virtual time. Jobs that share get the same rate, so one counter serves them all and their order
// never changes; jobs held by their cap have a fixed time of finish. Only a job that passes from one side to the other
// is touched.
#include "daemon/scheduler/virtual_server.h"

#include <algorithm>
#include <limits>
#include <utility>

namespace pmcd::scheduler {
namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();

template <typename State>
std::size_t index(State state) {
  return static_cast<std::size_t>(state);
}

}  // namespace

void VirtualServer::place(JobId id, Job& job, State state, double tag) {
  job.state = state;
  job.tag = tag;
  tags_[index(state)].insert({tag, id});
  if (job.marked) marked_tags_[index(state)].insert({tag, id});
  if (state == State::finished) return;
  caps_[index(state)].insert({job.cap, id});
  if (state == State::capped) capped_rate_ += job.cap;
}

void VirtualServer::unplace(JobId id, const Job& job) {
  tags_[index(job.state)].erase({job.tag, id});
  if (job.marked) marked_tags_[index(job.state)].erase({job.tag, id});
  if (job.state == State::finished) return;
  caps_[index(job.state)].erase({job.cap, id});
  if (job.state == State::capped) {
    // Sums of what comes and goes drift; nothing is left when nobody is.
    capped_rate_ = tags_[index(State::capped)].empty() ? 0 : capped_rate_ - job.cap;
  }
}

double VirtualServer::left(const Job& job) const {
  if (job.state == State::finished) return 0;
  return std::max(0.0, job.state == State::capped ? (job.tag - now_) * job.cap : job.tag - served_);
}

double VirtualServer::share_of_all() const {
  const double left = capacity_ - capped_rate_;
  const std::size_t sharing = tags_[index(State::sharing)].size();
  if (sharing > 0) return left / static_cast<double>(sharing);
  // Caps that together are the whole capacity are no overload, whatever rounding says.
  return left >= -1e-9 * capacity_ ? kInfinite : -kInfinite;
}

void VirtualServer::level() {
  Order& capped = caps_[index(State::capped)];
  Order& sharing = caps_[index(State::sharing)];
  while (!capped.empty() && capped.back().first > share_of_all()) {
    const JobId id = capped.back().second;
    Job& job = *jobs_.find(id);
    const double bytes = left(job);
    unplace(id, job);
    place(id, job, State::sharing, served_ + bytes);
  }
  while (!sharing.empty() && sharing.front().first <= share_of_all()) {
    const JobId id = sharing.front().second;
    Job& job = *jobs_.find(id);
    const double bytes = left(job);
    unplace(id, job);
    place(id, job, State::capped, now_ + bytes / job.cap);
  }
  share_ = sharing.empty() ? 0 : share_of_all();
}

void VirtualServer::set_capacity(double capacity) {
  if (capacity == capacity_) return;
  capacity_ = capacity;
  level();
}

void VirtualServer::add(JobId id, double bytes, double cap) {
  Job& job = *jobs_.emplace(id).first;
  job.cap = cap;
  place(id, job, State::sharing, served_ + bytes);
  level();
}

void VirtualServer::set_cap(JobId id, double cap) {
  Job& job = *jobs_.find(id);
  if (job.state == State::finished || job.cap == cap) {
    job.cap = cap;
    return;
  }
  const double bytes = left(job);
  unplace(id, job);
  job.cap = cap;
  place(id, job, State::sharing, served_ + bytes);
  level();
}

void VirtualServer::remove(JobId id) {
  const Job* job = jobs_.find(id);
  if (job == nullptr) return;
  unplace(id, *job);
  jobs_.erase(id);
  level();
}

void VirtualServer::mark(JobId id, bool marked) {
  Job& job = *jobs_.find(id);
  if (job.marked == marked) return;
  job.marked = marked;
  Order& order = marked_tags_[index(job.state)];
  if (marked) {
    order.insert({job.tag, id});
  } else {
    order.erase({job.tag, id});
  }
}

double VirtualServer::sharing_finish(double tag) const {
  return share_ > 0 ? now_ + (tag - served_) / share_ : kInfinite;
}

void VirtualServer::finish_first(State state) {
  const JobId id = tags_[index(state)].front().second;
  Job& job = *jobs_.find(id);
  unplace(id, job);
  place(id, job, State::finished, static_cast<double>(++finished_count_));
  level();
}

void VirtualServer::advance(double now) {
  while (true) {
    const Order& capped = tags_[index(State::capped)];
    const Order& sharing = tags_[index(State::sharing)];
    // NOLINTNEXTLINE(bugprone-narrowing-conversions): clang-tidy 14 errs on infinity
    const double capped_at = capped.empty() ? kInfinite : capped.front().first;
    const double sharing_at = sharing.empty() ? kInfinite : sharing_finish(sharing.front().first);
    const double next = std::min(capped_at, sharing_at);
    const double until = std::max(now_, std::min(next, now));
    served_ += share_ * (until - now_);
    now_ = until;
    if (next > now) break;
    finish_first(capped_at <= sharing_at ? State::capped : State::sharing);
  }
  now_ = std::max(now_, now);
  // Virtual service counts from a new zero when nobody shares, so that it never grows out of a double's digits.
  if (tags_[index(State::sharing)].empty()) served_ = 0;
}

VirtualServer::Finish VirtualServer::finish(JobId id) const {
  const Job& job = *jobs_.find(id);
  switch (job.state) {
    case State::finished:
      return {false, job.tag, id};
    case State::capped:
      return {true, job.tag, id};
    case State::sharing:
      break;
  }
  return {true, sharing_finish(job.tag), id};
}

std::optional<VirtualServer::JobId> VirtualServer::next_marked() const {
  const Order& finished = marked_tags_[index(State::finished)];
  if (!finished.empty()) return finished.front().second;
  const Order& capped = marked_tags_[index(State::capped)];
  const Order& sharing = marked_tags_[index(State::sharing)];
  if (capped.empty() && sharing.empty()) return std::nullopt;
  if (sharing.empty()) return capped.front().second;
  if (capped.empty()) return sharing.front().second;
  return capped.front().first <= sharing_finish(sharing.front().first) ? capped.front().second : sharing.front().second;
}

double VirtualServer::rate(JobId id) const {
  const Job& job = *jobs_.find(id);
  if (job.state == State::finished) return 0;
  return job.state == State::capped ? job.cap : share_;
}

}  // namespace pmcd::scheduler
