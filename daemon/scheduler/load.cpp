// SPDX-License-Identifier: MIT
// A client's part changes at its own events, when it has been served for long enough, and with the parts of time of its
// RecentRate.
#include "daemon/scheduler/load.h"

#include <algorithm>

namespace pmcd::scheduler {

double Load::expected(const Served& served, Time now) const {
  // What a client can take is what it will take, unless it has been served for long enough to show. One of whom nothing
  // is known may take everything.
  const Clients& clients = surroundings_.clients;
  const Client* client = clients.find(served.session);
  double expected = surroundings_.uplink;
  if (client != nullptr && client->speed) {
    // Held down by others perhaps, who are not there now.
    if (*client->speed < kMayFill * expected || *client->speed > expected) expected = *client->speed;
  } else if (const auto guess = clients.guessed_speed(served.session)) {
    expected = std::min(expected, *guess);
  }
  if (now - served.since < RecentRate::kSpan) return expected;
  return std::min(expected, clients.taking(served.session, now));
}

void Load::count(Served& served, Time now) {
  // It may be the old one again when the sum is asked for.
  if (surroundings_.uplink != counted_uplink_) counted_part_ = -1;
  sum_ -= served.counted;
  served.counted = expected(served, now);
  sum_ += served.counted;
}

void Load::count_all(Time now) {
  sum_ = 0;
  counted_uplink_ = surroundings_.uplink;
  served_.each([this, now](RequestKey, Served& served) {
    served.counted = 0;
    count(served, now);
  });
  counted_part_ = now / RecentRate::kPart;
}

void Load::served_since(RequestKey key, SessionKey session, Time since) {
  Served& served = *served_.emplace(key).first;
  young_.erase({served.since, key});
  served.session = session;
  served.since = since;
  young_.insert({since, key});
  count(served, since);
}

void Load::ends(RequestKey key) {
  const Served* served = served_.find(key);
  if (served == nullptr) return;
  sum_ -= served->counted;
  young_.erase({served->since, key});
  served_.erase(key);
}

void Load::clear() {
  served_ = {};
  young_ = {};
  sum_ = 0;
  counted_part_ = -1;
}

void Load::observed(RequestKey key, Time now) {
  if (Served* served = served_.find(key)) count(*served, now);
}

double Load::sum(Time now) {
  if (now / RecentRate::kPart != counted_part_ || surroundings_.uplink != counted_uplink_) count_all(now);
  while (!young_.empty() && now - young_.front().first >= RecentRate::kSpan) {
    const auto old = young_.front();
    young_.erase(old);
    count(*served_.find(old.second), now);
  }
  return sum_;
}

}  // namespace pmcd::scheduler
