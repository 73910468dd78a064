// SPDX-License-Identifier: MIT
// Expected time as the key, and a session that may be let through once more.
#include "daemon/scheduler/rules/fcsf.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "daemon/scheduler/keyed_rule.h"
#include "daemon/scheduler/words.h"

namespace pmcd::scheduler {
namespace {

class Fcsf final : public KeyedRule<double> {
 public:
  Fcsf(std::uint32_t burst, const Surroundings& surroundings) : burst_(burst), surroundings_(surroundings) {}

  [[nodiscard]] std::string_view name() const override { return "fcsf"; }

  [[nodiscard]] std::optional<RequestKey> next() const override {
    return follow_.empty() ? KeyedRule::next() : follow_.front();
  }

  [[nodiscard]] std::vector<Ranked> ranking(std::size_t most, Time now) const override {
    auto ranked = KeyedRule::ranking(most, now);
    std::erase_if(ranked, [this](const Ranked& one) { return follows(one.key); });
    std::vector<Ranked> first;
    for (const RequestKey key : follow_) first.push_back({key, "second of a burst to a fast client"});
    ranked.insert(ranked.begin(), first.begin(), first.end());
    ranked.resize(std::min(ranked.size(), most));
    return ranked;
  }

  void removed(const Request& request) override {
    KeyedRule::removed(request);
    followed_ = std::erase(follow_, request.key) > 0 ? request.key : 0;
  }

  void started(Request& request, const Client&, Time) override {
    if (request.key == followed_) {
      request.is_second_of_burst = true;
    } else if (!follow_.empty()) {
      follow_.erase(follow_.begin());  // a very old request has taken the slot that it was to have
    }
    followed_ = 0;
  }

  void finished(const Request& request, const Client& client, Outcome outcome, std::span<const Request* const> waiting,
                Time) override {
    if (burst_ < 2 || outcome != Outcome::complete || request.is_second_of_burst || !client.speed) return;
    const auto median = surroundings_.clients.median_active_speed();
    if (median && *client.speed < *median) return;
    const Request* next = nullptr;
    for (const Request* one : waiting) {
      if (!follows(one->key) && (next == nullptr || place_of(*one) < place_of(*next))) next = one;
    }
    if (next != nullptr) follow_.push_back(next->key);
  }

 private:
  [[nodiscard]] bool follows(RequestKey key) const {
    return std::find(follow_.begin(), follow_.end(), key) != follow_.end();
  }
  [[nodiscard]] std::pair<double, QueueOrder> place_of(const Request& request) const {
    return {key_at(request), QueueOrder::of(request)};
  }
  [[nodiscard]] double key_of(const Request& request, const Client& client, Time) const override {
    return client.speed ? static_cast<double>(request.remaining_bytes()) / *client.speed : 0;
  }
  [[nodiscard]] std::string reason(const double& key, const QueueOrder&, Time) const override {
    return key > 0 ? "expected to take " + seconds_text(key) : "not measured yet";
  }

  const std::uint32_t burst_;
  const Surroundings& surroundings_;
  std::vector<RequestKey> follow_;  ///< wait, and go before all others: one a slot that came free, in that order
  RequestKey followed_ = 0;         ///< stopped waiting just now, and stood there; 0: did not
};

}  // namespace

std::unique_ptr<Rule> make_fcsf(std::uint32_t burst, const Surroundings& surroundings) {
  return std::make_unique<Fcsf>(burst, surroundings);
}

}  // namespace pmcd::scheduler
