// SPDX-License-Identifier: MIT
// Max-min shares by moving flows across one level: those whose cap is below it are held by it, the others share.
#include "sim/links.h"

#include <algorithm>
#include <limits>

namespace pmcd::sim {
namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();

}  // namespace

Uplink::Flow Uplink::add() {
  flows_.emplace_back();
  return static_cast<Flow>(flows_.size() - 1);
}

double Uplink::remaining(const Body& body) const {
  if (!body.timed) return 0;
  return std::max(0.0, body.state == State::capped ? (body.tag - now_) * body.cap : body.tag - served_);
}

double Uplink::position(Flow flow) const {
  return flows_[flow].target - remaining(flows_[flow]);
}

double Uplink::rate(Flow flow) const {
  const Body& body = flows_[flow];
  if (body.state == State::still) return 0;
  return body.state == State::capped ? body.cap : share_;
}

void Uplink::enter(Flow flow, State state, double remaining) {
  Body& body = flows_[flow];
  body.state = state;
  if (body.timed) {
    body.tag = state == State::capped ? now_ + remaining / body.cap : served_ + remaining;
    tags(state).push(flow, body.tag);
  }
  if (state == State::capped) {
    capped_caps_.push(flow, -body.cap);
    capped_sum_ += body.cap;
  } else {
    sharing_caps_.push(flow, body.cap);
  }
}

void Uplink::leave(Flow flow) {
  Body& body = flows_[flow];
  if (body.timed) tags(body.state).erase(flow);
  if (body.state == State::capped) {
    capped_caps_.erase(flow);
    // A sum of what comes and goes drifts; nothing is left when nobody is.
    capped_sum_ = capped_caps_.empty() ? 0 : capped_sum_ - body.cap;
  } else {
    sharing_caps_.erase(flow);
  }
}

double Uplink::share_of_all() const {
  const double left = capacity_ - capped_sum_;
  if (!sharing_caps_.empty()) return left / static_cast<double>(sharing_caps_.size());
  // Caps that together are the whole capacity are no overload, whatever rounding says.
  return left >= -1e-9 * capacity_ ? kInfinite : -kInfinite;
}

void Uplink::level() {
  const auto pass = [this](Flow flow, State to) {
    const double bytes = remaining(flows_[flow]);
    leave(flow);
    enter(flow, to, bytes);
  };
  while (!capped_caps_.empty() && -capped_caps_.top_key() > share_of_all()) pass(capped_caps_.top(), State::sharing);
  while (!sharing_caps_.empty() && sharing_caps_.top_key() <= share_of_all()) pass(sharing_caps_.top(), State::capped);
  share_ = sharing_caps_.empty() ? 0 : share_of_all();
  // The common counter begins anew when nobody uses it, so that it never grows out of a double's digits.
  if (sharing_caps_.empty()) served_ = 0;
}

void Uplink::set_cap(Flow flow, double cap) {
  Body& body = flows_[flow];
  if (body.cap == cap) return;
  if (body.state == State::still) {
    body.cap = cap;
    return;
  }
  const double bytes = remaining(body);
  leave(flow);
  body.cap = cap;
  enter(flow, State::sharing, bytes);
  level();
}

void Uplink::move_to(Flow flow, double target) {
  Body& body = flows_[flow];
  const double bytes = target - position(flow);
  if (body.state == State::still) {
    body.target = target;
    body.timed = true;
    enter(flow, State::sharing, bytes);
    level();
    return;
  }
  if (body.timed) tags(body.state).erase(flow);
  body.target = target;
  body.timed = true;
  body.tag = body.state == State::capped ? now_ + bytes / body.cap : served_ + bytes;
  tags(body.state).push(flow, body.tag);
}

void Uplink::stop(Flow flow) {
  Body& body = flows_[flow];
  if (body.state == State::still) return;
  const double at = position(flow);
  leave(flow);
  body.state = State::still;
  body.timed = false;
  body.target = at;
  level();
}

std::optional<Uplink::Reached> Uplink::next() const {
  std::optional<Reached> first;
  if (!capped_tags_.empty()) first = Reached{std::max(now_, capped_tags_.top_key()), capped_tags_.top()};
  if (!sharing_tags_.empty()) {
    const double at = now_ + std::max(0.0, sharing_tags_.top_key() - served_) / share_;
    if (!first || at < first->at) first = Reached{at, sharing_tags_.top()};
  }
  return first;
}

void Uplink::advance(double now) {
  if (now <= now_) return;
  served_ += share_ * (now - now_);
  now_ = now;
}

Uplink::Flow Uplink::take_next() {
  const Reached reached = *next();
  advance(reached.at);
  Body& body = flows_[reached.flow];
  tags(body.state).erase(reached.flow);
  body.timed = false;
  return reached.flow;
}

}  // namespace pmcd::sim
