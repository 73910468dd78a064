// SPDX-License-Identifier: MIT
// What fsp promises: with one slot, interrupted at each chunk, and clients of equal speed nobody ends later than if all
// shared the uplink equally, up to one chunk. Equal sharing is worked out here by itself.
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <vector>

#include "sim/channel.h"
#include "sim/driver.h"
#include "tests/sim/support.h"

namespace pmcd::sim {
namespace {

struct Job {
  double begins = 0;
  double bytes = 0;
};

/// When each job ends if those that are there share `capacity` equally.
std::vector<double> equal_sharing(const std::vector<Job>& jobs, double capacity) {
  std::vector<double> left(jobs.size());
  std::vector<double> ends(jobs.size(), -1);
  for (std::size_t i = 0; i < jobs.size(); ++i) left[i] = jobs[i].bytes;
  double now = 0;
  while (std::find(ends.begin(), ends.end(), -1) != ends.end()) {
    double there = 0;
    double next = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < jobs.size(); ++i) {
      if (ends[i] >= 0) continue;
      if (jobs[i].begins <= now) {
        ++there;
      } else {
        next = std::min(next, jobs[i].begins);
      }
    }
    for (std::size_t i = 0; i < jobs.size(); ++i) {
      if (ends[i] < 0 && jobs[i].begins <= now) next = std::min(next, now + left[i] * there / capacity);
    }
    for (std::size_t i = 0; i < jobs.size(); ++i) {
      if (ends[i] >= 0 || jobs[i].begins > now) continue;
      left[i] -= (next - now) * capacity / there;
      if (left[i] <= 1e-6) ends[i] = next;
    }
    now = next;
  }
  return ends;
}

TEST(EqualSharing, by_hand) {
  // The second comes when the first has 50 of its 100 left; both get 5 a second until the second's 30 are there.
  const auto ends = equal_sharing({{0, 100}, {5, 30}}, 10);
  EXPECT_DOUBLE_EQ(ends[1], 11);
  EXPECT_DOUBLE_EQ(ends[0], 13);
}

scheduler::Request request(scheduler::RequestKey key, std::uint64_t bytes, double now) {
  scheduler::Request request;
  request.key = request.session = key;
  request.size_bytes = bytes;
  request.asked_at = scheduler_time(now);
  return request;
}

TEST(Fsp, who_has_left_with_all_its_bytes_is_still_served_on_paper) {
  scheduler::Scheduler scheduler(policy("fsp", {"uplink=8"}));  // 1000 bytes a second
  scheduler.enqueue(request(1, 1'000, 0), scheduler_time(0));
  scheduler.enqueue(request(2, 3'000, 0), scheduler_time(0));
  EXPECT_EQ(scheduler.take(scheduler_time(0))->key, 1U);
  scheduler.complete(1, scheduler_time(1));
  scheduler.remove_session(1, scheduler_time(1));
  // Equal sharing has given 1 and 2 half of 1,500 bytes each: 2 has 2,250 to come, which is more than the 2,100 of 3.
  scheduler.enqueue(request(3, 2'100, 1.5), scheduler_time(1.5));
  EXPECT_EQ(scheduler.take(scheduler_time(1.5))->key, 3U);
  // Who leaves in the middle leaves equal sharing too.
  scheduler.remove_session(3, scheduler_time(1.6));
  EXPECT_EQ(scheduler.take(scheduler_time(1.6))->key, 2U);
}

struct Lateness {
  double latest = 0;    ///< seconds after the end under equal sharing, of whoever comes off worst
  double earliest = 0;  ///< seconds before it, of whoever gains most
};

/// 30 clients of equal speed at an uplink of 1500 kbit/s that is busy most of the time.
Lateness lateness(const Scenario& scenario) {
  // The rule's clock has to keep up with the real one: its uplink is what is left for packets beside frames' headers.
  const Outcome outcome = simulate(scenario, policy("fsp", {"slots=1", "quantum=1", "uplink=1440"}));
  std::vector<Job> jobs;
  double payload = 0;
  double headers = 34 * static_cast<double>(outcome.chunks);
  for (const Fetch& fetch : outcome.fetches) {
    const Mesh& mesh = scenario.meshes[fetch.mesh];
    jobs.push_back({fetch.begins, static_cast<double>(mesh.bytes)});
    payload += jobs.back().bytes;
    headers += 15 * static_cast<double>(mesh.levels.size());
  }
  const auto ends = equal_sharing(jobs, goodput(scenario.uplink_kbit) * payload / (payload + headers));
  Lateness lateness;
  for (std::size_t i = 0; i < jobs.size(); ++i) {
    const double late = outcome.fetches[i].begins + outcome.fetches[i].complete - ends[i];
    lateness.latest = std::max(lateness.latest, late);
    lateness.earliest = std::max(lateness.earliest, -late);
  }
  return lateness;
}

Scenario equal_speeds(std::uint64_t seed) {
  Scenario scenario = paper_scenario();
  scenario.uplink_kbit = 1500;
  scenario.lines = {{"equal", 100'000, 100'000, 0, 1}};
  scenario.setup_round_trips = 0;
  scenario.open = 8;
  scenario.tcp.queue_seconds = 0;
  scenario.tcp.queue_bytes = 0;
  scenario.clients = draw_clients(scenario, {30, {Arrivals::poisson, 2.5}, 1, 0, seed});
  return scenario;
}

/// A chunk is 100 ms of what the line takes, which for one at a time is the uplink.
constexpr double kChunkSeconds = 0.1;

TEST(Fsp, nobody_ends_later_than_under_equal_sharing_up_to_one_chunk) {
  double gain = 0;
  for (std::uint64_t seed = 1; seed <= 100; ++seed) {
    Scenario scenario = equal_speeds(seed);
    scenario.tcp.sockets_buffer = false;
    const Lateness found = lateness(scenario);
    EXPECT_LE(found.latest, kChunkSeconds) << "seed " << seed;
    gain = std::max(gain, found.earliest);
  }
  EXPECT_GT(gain, 5);  // and somebody ends long before
}

TEST(Fsp, a_socket_adds_what_it_holds) {
  for (std::uint64_t seed = 1; seed <= 100; ++seed) {
    EXPECT_LE(lateness(equal_speeds(seed)).latest, 2 * kChunkSeconds) << "seed " << seed;
  }
}

}  // namespace
}  // namespace pmcd::sim
