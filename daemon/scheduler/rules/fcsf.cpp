// SPDX-License-Identifier: MIT
// Expected time as the key, and a session that may be let through once more.
#include "daemon/scheduler/rules/fcsf.h"

#include <algorithm>

#include "daemon/scheduler/keyed_rule.h"
#include "daemon/scheduler/words.h"

namespace pmcd::scheduler {
namespace {

class Fcsf final : public KeyedRule<double> {
 public:
  Fcsf(std::uint32_t burst, const Surroundings& surroundings) : burst_(burst), surroundings_(surroundings) {}

  [[nodiscard]] std::string_view name() const override { return "fcsf"; }

  [[nodiscard]] std::optional<RequestKey> next() const override { return follows_ ? follows_ : KeyedRule::next(); }

  [[nodiscard]] std::vector<Ranked> ranking(std::size_t most, Time now) const override {
    auto ranked = KeyedRule::ranking(most, now);
    if (!follows_ || most == 0) return ranked;
    std::erase_if(ranked, [this](const Ranked& one) { return one.key == *follows_; });
    ranked.resize(std::min(ranked.size(), most - 1));
    ranked.insert(ranked.begin(), {*follows_, "second of a burst to a fast client"});
    return ranked;
  }

  void removed(const Request& request) override {
    KeyedRule::removed(request);
    if (follows_ == request.key) follows_.reset();
  }

  void started(const Request& request, const Client&, Time) override {
    // The slot is given: to the one that was to follow, which therefore is the second, or to another.
    second_ = request.key == followed_ ? request.key : 0;
    follows_.reset();
    followed_ = 0;
  }

  void finished(const Request& request, const Client& client, Outcome outcome, std::span<const Request* const> waiting,
                Time) override {
    const bool was_second = request.key == second_;
    if (was_second) second_ = 0;
    if (burst_ < 2 || outcome != Outcome::complete || was_second || waiting.empty() || !client.speed) return;
    const auto median = surroundings_.clients.median_active_speed();
    if (median && *client.speed < *median) return;
    const Request* next = *std::min_element(waiting.begin(), waiting.end(), [this](const auto* a, const auto* b) {
      return std::pair(key_at(*a), QueueOrder::of(*a)) < std::pair(key_at(*b), QueueOrder::of(*b));
    });
    follows_ = next->key;
    followed_ = next->key;
  }

 private:
  [[nodiscard]] double key_of(const Request& request, const Client& client, Time) const override {
    return client.speed ? static_cast<double>(request.remaining_bytes()) / *client.speed : 0;
  }
  [[nodiscard]] std::string reason(const double& key, const QueueOrder&, Time) const override {
    return key > 0 ? "expected to take " + seconds_text(key) : "not measured yet";
  }

  const std::uint32_t burst_;
  const Surroundings& surroundings_;
  std::optional<RequestKey> follows_;  ///< waits, and goes before all others
  RequestKey followed_ = 0;            ///< the same until a slot is given; 0: none
  RequestKey second_ = 0;              ///< runs as the second of a burst
};

}  // namespace

std::unique_ptr<Rule> make_fcsf(std::uint32_t burst, const Surroundings& surroundings) {
  return std::make_unique<Fcsf>(burst, surroundings);
}

}  // namespace pmcd::scheduler
