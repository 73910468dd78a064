// SPDX-License-Identifier: MIT
// Max-min sharing on paper, against a second simulation of it that knows no order, tags or counters: it cuts time into
// small steps and pours the capacity into the jobs that are left, step by step.
#include "daemon/scheduler/virtual_server.h"

#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <vector>

namespace pmcd::scheduler {
namespace {

constexpr double kNoCap = std::numeric_limits<double>::infinity();
using JobId = VirtualServer::JobId;

TEST(VirtualServer, OneJobGetsAllThatItCanTake) {
  VirtualServer s;
  s.set_capacity(100);
  s.add(1, 1'000, kNoCap);
  EXPECT_DOUBLE_EQ(s.rate(1), 100);
  EXPECT_DOUBLE_EQ(s.finish(1).when, 10);
  s.set_cap(1, 40);
  EXPECT_DOUBLE_EQ(s.rate(1), 40);
  EXPECT_DOUBLE_EQ(s.finish(1).when, 25);
  s.advance(5);
  s.set_cap(1, 400);
  EXPECT_DOUBLE_EQ(s.rate(1), 100);
  EXPECT_DOUBLE_EQ(s.finish(1).when, 13) << "800 are left at 5";
}

TEST(VirtualServer, WhatOneCannotTakeTheOthersShare) {
  VirtualServer s;
  s.set_capacity(90);
  s.add(1, 1'000, 10);
  s.add(2, 1'000, kNoCap);
  s.add(3, 1'000, 60);
  EXPECT_DOUBLE_EQ(s.rate(1), 10);
  EXPECT_DOUBLE_EQ(s.rate(2), 40);
  EXPECT_DOUBLE_EQ(s.rate(3), 40);
  s.remove(2);
  EXPECT_DOUBLE_EQ(s.rate(3), 60);
  s.set_capacity(15);
  EXPECT_DOUBLE_EQ(s.rate(1), 7.5);
  EXPECT_DOUBLE_EQ(s.rate(3), 7.5);
}

TEST(VirtualServer, OneThatFinishesLeavesItsShare) {
  VirtualServer s;
  s.set_capacity(100);
  s.add(1, 100, kNoCap);
  s.add(2, 200, kNoCap);
  s.advance(2.5);
  EXPECT_TRUE(s.finished(1));
  EXPECT_FALSE(s.finish(1).to_come);
  EXPECT_EQ(s.rate(1), 0);
  EXPECT_DOUBLE_EQ(s.rate(2), 100);
  EXPECT_DOUBLE_EQ(s.finish(2).when, 3) << "100 at half speed for 2 s, then 100 at full speed";
  EXPECT_LT(s.finish(1), s.finish(2));
}

TEST(VirtualServer, NextIsOfTheMarkedFinishedOnesFirst) {
  VirtualServer s;
  s.set_capacity(100);
  s.add(3, 100, kNoCap);
  s.add(1, 400, kNoCap);
  s.add(2, 300, kNoCap);
  EXPECT_FALSE(s.next_marked());
  s.mark(1, true);
  EXPECT_EQ(s.next_marked(), 1U);
  s.mark(2, true);
  EXPECT_EQ(s.next_marked(), 2U);
  s.mark(3, true);
  s.advance(100);
  EXPECT_EQ(s.next_marked(), 3U) << "finished first";
  s.mark(3, false);
  EXPECT_EQ(s.next_marked(), 2U);
  s.remove(2);
  EXPECT_EQ(s.next_marked(), 1U);
  s.add(4, 1, kNoCap);
  s.mark(4, true);
  EXPECT_EQ(s.next_marked(), 1U) << "what has finished goes before what has not";
}

TEST(VirtualServer, TiesByJob) {
  VirtualServer s;
  s.set_capacity(100);
  for (const JobId job : {7U, 5U, 6U}) {
    s.add(job, 100, kNoCap);
    s.mark(job, true);
  }
  EXPECT_EQ(s.next_marked(), 5U);
}

struct Poured {
  double left = 0;
  double cap = 0;
  double finished_at = kNoCap;
};
using Pool = std::map<JobId, Poured>;

/// What each gets: those with the least caps first, each its cap or an equal part of what is left.
std::map<JobId, double> rates(const Pool& jobs, double capacity) {
  std::vector<std::pair<double, JobId>> by_cap;
  for (const auto& [id, job] : jobs) {
    if (job.left > 0) by_cap.emplace_back(job.cap, id);
  }
  std::sort(by_cap.begin(), by_cap.end());
  std::map<JobId, double> got;
  auto takers = static_cast<double>(by_cap.size());
  for (const auto& [cap, id] : by_cap) {
    got[id] = std::min(cap, capacity / takers--);
    capacity -= got[id];
  }
  return got;
}

void pour(Pool& jobs, double capacity, double from, double to, double step) {
  for (double t = from; t < to - step / 2; t += step) {
    for (const auto& [id, rate] : rates(jobs, capacity)) {
      Poured& job = jobs.at(id);
      job.left -= rate * step;
      if (job.left <= 1e-6) job.left = 0, job.finished_at = t + step;
    }
  }
}

double cap_drawn() {
  return *rc::gen::element(kNoCap, 5.0, 20.0, 20.0, 37.0, 100.0, 400.0);
}

TEST(VirtualServer, FinishesAsASimulationInSmallSteps) {
  EXPECT_TRUE(rc::check("order and rates of max-min sharing", [] {
    constexpr double kStep = 0.01;
    VirtualServer s;
    Pool jobs;
    std::vector<JobId> removed;
    double capacity = *rc::gen::inRange(20, 200);
    s.set_capacity(capacity);
    double now = 0;
    JobId last = 0;
    const auto events = *rc::gen::resize(20, rc::gen::container<std::vector<int>>(rc::gen::inRange(0, 12)));
    for (const int event : events) {
      const double then = now + *rc::gen::inRange(0, 300) * kStep;
      pour(jobs, capacity, now, then, kStep);
      s.advance(then);
      now = then;
      const auto any = [&] { return *rc::gen::inRange<JobId>(1, last + 1); };
      if (event < 7 || last == 0) {
        const auto bytes = static_cast<double>(*rc::gen::inRange(1, 600));
        const double cap = cap_drawn();
        s.add(++last, bytes, cap);
        s.mark(last, true);
        jobs[last] = {bytes, cap};
      } else if (event < 9) {
        const JobId job = any();
        const double cap = cap_drawn();
        if (!s.contains(job)) continue;
        s.set_cap(job, cap);
        jobs.at(job).cap = cap;
      } else if (event < 11) {
        s.set_capacity(capacity = *rc::gen::inRange(20, 200));
      } else if (const JobId job = any(); s.contains(job)) {
        s.remove(job);
        jobs.erase(job);
      }
      // Jobs that one of the two sees finished a step before the other shift all rates for that step.
      const bool same = std::all_of(jobs.begin(), jobs.end(),
                                    [&](const auto& job) { return s.finished(job.first) == (job.second.left <= 0); });
      if (same) {
        const auto expected = rates(jobs, capacity);
        for (const auto& [id, rate] : expected) RC_ASSERT(std::abs(s.rate(id) - rate) <= 1e-6 * capacity);
      }
    }
    // To the end; each that is foretold to finish first, all being marked, does.
    while (true) {
      const double then = now + 0.1;
      pour(jobs, capacity, now, then, kStep);
      std::vector<VirtualServer::Finish> foretold;
      for (const auto& [id, job] : jobs) {
        if (!s.finished(id)) foretold.push_back(s.finish(id));
      }
      if (foretold.empty()) break;
      s.advance(now = then);
      const auto first = *std::min_element(foretold.begin(), foretold.end());
      const bool any_finished =
          std::any_of(foretold.begin(), foretold.end(), [&](const auto& finish) { return s.finished(finish.job); });
      RC_ASSERT(any_finished == s.finished(first.job));
      RC_ASSERT(now < 10'000);
    }
    // Those that finish in steps that lie apart do so in the same order in both.
    const double apart = 3 * kStep * static_cast<double>(last + 1);
    for (const auto& [a, job_a] : jobs) {
      for (const auto& [b, job_b] : jobs) {
        if (job_a.finished_at + apart < job_b.finished_at) RC_ASSERT(s.finish(a) < s.finish(b));
      }
    }
    while (const auto next = s.next_marked()) {
      for (const auto& [id, job] : jobs) RC_ASSERT(s.finish(id) >= s.finish(*next));
      s.remove(*next);
      jobs.erase(*next);
    }
    RC_ASSERT(jobs.empty());
  }));
}

TEST(VirtualServer, CountersDoNotDriftInALongLife) {
  VirtualServer s;
  s.set_capacity(100);
  double now = 0;
  for (JobId job = 1; job <= 200'000; ++job) {
    s.add(job, 60, job % 3 == 0 ? 0.1 : kNoCap);
    if (job % 3 == 0) s.set_cap(job, 90);
    s.advance(now += 1);
    if (job > 10) s.remove(job - 10);
  }
  s.advance(now += 100);
  for (JobId job = 200'000 - 9; job <= 200'000; ++job) {
    ASSERT_TRUE(s.finished(job));
    s.remove(job);
  }
  s.add(1, 1'000, kNoCap);
  EXPECT_NEAR(s.rate(1), 100, 1e-9);
  EXPECT_NEAR(s.finish(1).when - now, 10, 1e-6);
}

}  // namespace
}  // namespace pmcd::scheduler
