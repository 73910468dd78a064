// SPDX-License-Identifier: MIT
#include "sim/path.h"

#include <algorithm>

namespace pmcd::sim {
namespace {

/// The least time after which Linux sends again.
constexpr double kAgain = 0.2;

}  // namespace

Path::Path(Timeline& timeline, Shaper& uplink, const Line& line, double line_queue)
    : timeline_(&timeline),
      uplink_(&uplink),
      down_(Shaper::of(line.down_kbit, line_queue)),
      up_(Shaper::of(line.up_kbit, line_queue)),
      delay_(line.round_trip / 2) {}

double Path::passed_on(double through, double& last) {
  return last = std::max(last, timeline_->waking(through + delay_));
}

bool Path::send_down(double ip_bytes, Step has_left, Step comes) {
  const auto left = uplink_->pass(ip_bytes + kEthernetBytes, timeline_->now());
  if (!left) return false;
  const bool waits = *left > timeline_->now();
  if (waits) timeline_->at(*left, std::move(has_left));
  timeline_->at(*left, [this, ip_bytes, comes = std::move(comes)]() mutable {
    const auto through = down_.pass(ip_bytes, timeline_->now());
    if (through) timeline_->at(passed_on(*through, last_down_), std::move(comes));
  });
  return waits;
}

void Path::send_up(double ip_bytes, Step comes) {
  const auto through = up_.pass(ip_bytes, timeline_->now());
  if (through) timeline_->at(passed_on(*through, last_up_), std::move(comes));
}

void Path::tell_client(double ip_bytes, Step comes) {
  const auto left = uplink_->pass(ip_bytes + kEthernetBytes, timeline_->now());
  const double next = left ? *left : timeline_->now() + kAgain + round_trip();
  timeline_->at(next, [this, ip_bytes, left, comes = std::move(comes)]() mutable {
    const auto through = left ? down_.pass(ip_bytes, timeline_->now()) : std::nullopt;
    if (through) {
      timeline_->at(passed_on(*through, last_down_), std::move(comes));
    } else {
      const double again = left ? kAgain + round_trip() : 0;
      timeline_->at(timeline_->now() + again,
                    [this, ip_bytes, comes = std::move(comes)]() mutable { tell_client(ip_bytes, std::move(comes)); });
    }
  });
}

void Path::tell_server(double ip_bytes, Step comes) {
  const auto through = up_.pass(ip_bytes, timeline_->now());
  if (through) {
    timeline_->at(passed_on(*through, last_up_), std::move(comes));
  } else {
    timeline_->at(timeline_->now() + kAgain + round_trip(),
                  [this, ip_bytes, comes = std::move(comes)]() mutable { tell_server(ip_bytes, std::move(comes)); });
  }
}

}  // namespace pmcd::sim
