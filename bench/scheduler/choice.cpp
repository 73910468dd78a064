// SPDX-License-Identifier: MIT
// What a choice costs: for each rule and number of waiting requests, the time of one turn of a client (it is taken,
// acknowledges, is measured, completes and asks for its next packet) and of taking alone, and of changing the rule
// while all of them wait. Prints Markdown tables; judges nothing, sends nothing, and the times of its clients are made
// up.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <exception>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "daemon/scheduler/mesh_profile.h"
#include "daemon/scheduler/scheduler.h"

namespace pmcd::scheduler {
namespace {

using Clock = std::chrono::steady_clock;
using std::chrono::milliseconds;

constexpr std::uint32_t kPackets = 8;

struct Mesh {
  std::vector<std::uint64_t> sizes;
  std::shared_ptr<const MeshProfile> profile;
};

/// A few meshes of eight packets: sizes double and errors halve, more or less.
std::vector<Mesh> some_meshes(std::mt19937& random) {
  std::vector<Mesh> meshes(50);
  std::uniform_real_distribution<double> more_or_less(0.7, 1.4);
  for (Mesh& mesh : meshes) {
    double size = 500 * more_or_less(random);
    double error = 0.05;
    std::vector<MeshProfile::Level> levels;
    for (std::uint32_t k = 0; k < kPackets; ++k) {
      mesh.sizes.push_back(static_cast<std::uint64_t>(size));
      levels.push_back({mesh.sizes.back(), mesh.sizes.back() / 4, error});
      size *= 2 * more_or_less(random);
      error *= 0.5 * more_or_less(random);
    }
    mesh.profile = std::make_shared<MeshProfile>(levels, 1e-5);
  }
  return meshes;
}

/// So many sessions with one request each, in the middle of their lives: measured, and anywhere in their meshes.
class Crowd {
 public:
  Crowd(const Policy& policy, std::size_t sessions) : scheduler(policy), meshes_(some_meshes(random_)) {
    std::uniform_int_distribution<std::uint64_t> kbit(33, 8'000);
    for (SessionKey session = 0; session < sessions; ++session) {
      speeds_.push_back(kbit(random_) * 125);
      positions_.push_back(0);
      meshes_of_.push_back(random_() % meshes_.size());
      packets_.push_back(static_cast<std::uint32_t>(random_() % kPackets));
      observe(session, Time{0}, true);
      observe(session, milliseconds(2'500), true);
      for (std::uint32_t k = 0; k < packets_[session]; ++k)
        scheduler.acknowledged(session, mesh(session).sizes[k], now_);
    }
    for (SessionKey session = 0; session < sessions; ++session) ask(session);
  }

  void turn() {
    const Request taken = *scheduler.take(now_);
    const SessionKey session = taken.session;
    pass(taken);
    scheduler.acknowledged(session, taken.remaining_bytes(), now_);
    // Speeds flutter, so that keys do.
    speeds_[session] = speeds_[session] * (90 + random_() % 21) / 100 + 1'000;
    observe(session, milliseconds(1'100), true);
    complete(taken);
  }
  /// As long as it takes on that line, so that what rules reckon on paper keeps up.
  void pass(const Request& request) {
    const double speed = std::min(scheduler.uplink(), static_cast<double>(speeds_[request.session]));
    now_ += std::chrono::duration_cast<Time>(
        std::chrono::duration<double>(static_cast<double>(request.remaining_bytes()) / speed));
  }
  void complete(const Request& request) {
    const SessionKey session = request.session;
    scheduler.complete(request.key, now_);
    packets_[session] = (packets_[session] + 1) % kPackets;
    if (packets_[session] == 0) meshes_of_[session] = random_() % meshes_.size();
    ask(session);
  }

  Scheduler scheduler;
  [[nodiscard]] Time now() const { return now_; }

 private:
  [[nodiscard]] const Mesh& mesh(SessionKey session) const { return meshes_[meshes_of_[session]]; }

  void ask(SessionKey session) {
    Request request;
    request.key = ++last_key_;
    request.session = session;
    request.mesh = meshes_of_[session];
    request.packet = packets_[session];
    request.size_bytes = mesh(session).sizes[request.packet];
    request.rest_bytes = mesh(session).profile->bytes_behind(request.packet);
    request.profile = mesh(session).profile;
    request.asked_at = now_;
    scheduler.enqueue(std::move(request), now_);
  }

  /// A sample `later` than the last one, in which the client took what its speed allows.
  void observe(SessionKey session, Time later, bool owes) {
    sampled_ += later;
    positions_[session] += static_cast<std::uint64_t>(static_cast<double>(speeds_[session]) *
                                                      std::chrono::duration<double>(later).count());
    scheduler.observe(session, {sampled_, positions_[session], owes, 0, Time{0}}, now_);
  }

  std::mt19937 random_{1};
  std::vector<Mesh> meshes_;
  std::vector<std::uint64_t> speeds_;
  std::vector<std::uint64_t> positions_;
  std::vector<std::size_t> meshes_of_;
  std::vector<std::uint32_t> packets_;
  Time now_{0};
  Time sampled_{0};  ///< of the clients' samples, which need a time of their own to be worth something
  RequestKey last_key_ = 0;
};

double median(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2), values.end());
  return values[values.size() / 2];
}

double microseconds(Clock::duration time) {
  return std::chrono::duration<double, std::micro>(time).count();
}

struct Cost {
  double turn = 0;  ///< us
  double take = 0;
};

Cost cost(const Policy& policy, std::size_t waiting, int choices, int repetitions) {
  Crowd crowd(policy, waiting);
  for (int n = 0; n < choices; ++n) crowd.turn();  // to where it stays as it is
  std::vector<double> turns;
  std::vector<double> takes;
  for (int r = 0; r < repetitions; ++r) {
    const auto start = Clock::now();
    for (int n = 0; n < choices; ++n) crowd.turn();
    turns.push_back(microseconds(Clock::now() - start) / choices);
    Clock::duration taking{0};
    for (int n = 0; n < choices; ++n) {
      const auto before = Clock::now();
      const auto taken = crowd.scheduler.take(crowd.now());
      taking += Clock::now() - before;
      crowd.pass(*taken);
      crowd.complete(*taken);
    }
    takes.push_back(microseconds(taking) / choices);
  }
  return {median(turns), median(takes)};
}

double switch_cost(const Policy& policy, std::size_t waiting, int repetitions) {
  Policy other;
  other.uplink = policy.uplink;
  Crowd crowd(other, waiting);
  std::vector<double> times;
  for (int r = 0; r < repetitions; ++r) {
    crowd.scheduler.switch_to(other, crowd.now());
    const auto start = Clock::now();
    crowd.scheduler.switch_to(policy, crowd.now());
    times.push_back(microseconds(Clock::now() - start));
  }
  return median(times);
}

void print_header(const char* first, const std::vector<std::size_t>& waiting) {
  std::printf("| %-14s |", first);
  for (const std::size_t n : waiting) std::printf(" %zu |", n);
  std::printf("\n| --- |");
  for (std::size_t n = 0; n < waiting.size(); ++n) std::printf(" --- |");
  std::printf("\n");
}

std::vector<Policy> policies() {
  std::vector<Policy> all;
  for (const RuleEntry& rule : all_rules()) {
    Policy policy;
    policy.rule = rule.name;
    policy.uplink = 1'250'000;
    all.push_back(policy);
    for (const RuleOption& option : rule.options) {
      policy.rule_options[std::string(option.name)] = option.words.back();
      all.push_back(policy);
    }
  }
  return all;
}

std::string title(const Policy& policy) {
  return policy.rule_options.empty() ? policy.rule : policy.rule + " " + join_options(policy.rule_options);
}

void run(const std::vector<std::size_t>& waiting, const std::vector<std::size_t>& switching, int choices,
         int repetitions, const std::string& only) {
  std::printf(
      "A turn: take, acknowledged, observe, complete, enqueue of the next; and take alone. us, medians of "
      "%d times %d.\n\n",
      repetitions, choices);
  print_header("waiting", waiting);
  for (const Policy& policy : policies()) {
    if (!only.empty() && policy.rule != only) continue;
    std::printf("| %-14s |", title(policy).c_str());
    for (const std::size_t n : waiting) {
      const Cost c = cost(policy, n, choices, repetitions);
      std::printf(" %.2f, %.2f |", c.turn, c.take);
      std::fflush(stdout);
    }
    std::printf("\n");
  }
  std::printf("\nswitch_to() with so many waiting. ms, medians of %d.\n\n", repetitions);
  print_header("waiting", switching);
  for (const Policy& policy : policies()) {
    if (!only.empty() && policy.rule != only) continue;
    std::printf("| %-14s |", title(policy).c_str());
    for (const std::size_t n : switching) std::printf(" %.3f |", switch_cost(policy, n, repetitions) / 1'000);
    std::printf("\n");
  }
}

}  // namespace
}  // namespace pmcd::scheduler

int main(int argc, char** argv) try {
  CLI::App app{"Measures what a choice of the scheduler costs under each rule."};
  std::vector<std::size_t> waiting = {10, 1'000, 100'000};
  std::vector<std::size_t> switching = {50, 1'000, 100'000};
  int choices = 20'000;
  int repetitions = 7;
  std::string only;
  app.add_option("--waiting", waiting, "numbers of waiting requests")->delimiter(',')->check(CLI::PositiveNumber);
  app.add_option("--switching", switching, "the same for switches")->delimiter(',')->check(CLI::PositiveNumber);
  app.add_option("--choices", choices, "choices a repetition")->check(CLI::PositiveNumber);
  app.add_option("--repetitions", repetitions)->check(CLI::PositiveNumber);
  app.add_option("--rule", only, "this rule alone");
  CLI11_PARSE(app, argc, argv);
  pmcd::scheduler::run(waiting, switching, choices, repetitions, only);
  return 0;
} catch (const std::exception& error) {
  std::fprintf(stderr, "scheduler_choice: %s\n", error.what());
  return 1;
}
