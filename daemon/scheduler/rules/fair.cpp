// SPDX-License-Identifier: MIT
// Each session with something waiting stands under the round in which its credit will be enough, so the next one is the
// least round and nobody's credit has to be touched when a round passes.
#include "daemon/scheduler/rules/fair.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <tuple>
#include <utility>
#include <vector>

#include "daemon/scheduler/key_map.h"
#include "daemon/scheduler/sorted_blocks.h"
#include "daemon/scheduler/words.h"

namespace pmcd::scheduler {
namespace {

class Fair final : public Rule {
 public:
  [[nodiscard]] std::string_view name() const override { return "fair"; }

  void enqueued(const Request& request, const Client& client, Time) override {
    const auto [held, made] = shares_.emplace(request.session);
    if (made) *held = std::make_unique<Share>();
    Share& share = **held;
    unplace(share);
    settle(share);
    share.weight = client.weight;
    const Waiting one{QueueOrder::of(request), &request};
    share.waiting.insert(std::upper_bound(share.waiting.begin(), share.waiting.end(), one), one);
    place(share);
  }

  void removed(const Request& request) override {
    Share& share = share_of(request.session);
    unplace(share);
    settle(share);
    std::erase(share.waiting, Waiting{QueueOrder::of(request), &request});
    place(share);
  }

  [[nodiscard]] std::optional<RequestKey> next() const override {
    if (order_.empty()) return std::nullopt;
    return order_.front().head.key;
  }

  [[nodiscard]] std::vector<Ranked> ranking(std::size_t most, Time) const override {
    // Who goes next is exact; further back each session's requests are taken to follow each other in its own rounds.
    std::vector<std::tuple<double, QueueOrder, const Share*>> lines;
    order_.each([&](const Place& place) {
      const Share& share = share_of(place.head.session);
      double needed = 0;
      for (const auto& [order, request] : share.waiting) {
        needed += static_cast<double>(request->remaining_bytes());
        lines.emplace_back(round_of(share, needed), order, &share);
        if (lines.size() >= 4 * most) break;
      }
      return true;
    });
    std::sort(lines.begin(), lines.end());
    std::vector<Ranked> ranked;
    for (const auto& [round, order, share] : lines) {
      if (ranked.size() == most) break;
      ranked.push_back({order.key, round <= round_
                                       ? "has the credit it needs"
                                       : "has the credit in " + number_text(round - round_) + " rounds of " +
                                             bytes_text(static_cast<std::uint64_t>(a_round(*share)))});
    }
    return ranked;
  }

  void client_changed(const Client& client, std::span<const Request* const>, Time) override {
    const auto* held = shares_.find(client.session);
    if (held == nullptr || (*held)->weight == client.weight) return;
    Share& share = **held;
    unplace(share);
    settle(share);
    share.weight = client.weight;
    place(share);
  }

  void started(Request& request, const Client&, Time) override {
    Share& share = share_of(request.session);
    const auto bytes = static_cast<double>(request.remaining_bytes());
    // Rounds pass until its credit is enough, unless it went before its time (it was very old): then it owes.
    double round = std::max(round_, round_of(share, bytes));
    unplace(share);
    if (!order_.empty()) round = std::min(round, std::max(round_, order_.front().round));
    share.credit += (round - round_) * a_round(share) - bytes;
    round_ = round;
    share.since = round_;
    share.running.push_back(request.key);
    place(share);
  }

  void finished(const Request& request, const Client&, Outcome outcome, std::span<const Request* const>,
                Time) override {
    Share& share = share_of(request.session);
    if (std::erase(share.running, request.key) == 0) return;
    const std::uint64_t end = outcome == Outcome::complete ? request.size_bytes : request.offset_bytes;
    unplace(share);
    settle(share);
    share.credit += static_cast<double>(request.size_bytes - end);
    place(share);
  }

  void session_gone(SessionKey session, Time) override {
    const auto* held = shares_.find(session);
    if (held == nullptr) return;
    unplace(**held);
    shares_.erase(session);
  }

 private:
  struct Place {
    double round = 0;
    QueueOrder head;
    bool operator<(const Place& other) const { return std::tie(round, head) < std::tie(other.round, other.head); }
  };
  using Waiting = std::pair<QueueOrder, const Request*>;
  struct Share {
    double credit = 0;  ///< bytes, at the end of round `since`
    double since = 0;
    double weight = 1;
    std::vector<Waiting> waiting;  ///< ascending, a handful
    std::vector<RequestKey> running;
    std::optional<Place> place;
  };

  [[nodiscard]] Share& share_of(SessionKey session) const { return **shares_.find(session); }
  static double a_round(const Share& share) { return kFairCredit * share.weight; }
  [[nodiscard]] static double round_of(const Share& share, double bytes) {
    return share.since + std::max(0.0, std::ceil((bytes - share.credit) / a_round(share)));
  }
  /// Rounds bring credit to those that wait. Who asks for nothing keeps what is left of it, which is his whenever he
  /// comes back (most clients ask for one packet at a time), and gets none, but that it pays what he owes.
  void settle(Share& share) const {
    const double settled = share.credit + (round_ - share.since) * a_round(share);
    share.credit = share.waiting.empty() ? std::min(settled, std::max(share.credit, 0.0)) : settled;
    share.since = round_;
  }
  void unplace(Share& share) {
    if (share.place) order_.erase(*share.place);
    share.place.reset();
  }
  void place(Share& share) {
    if (share.waiting.empty()) return;
    const auto& [order, request] = share.waiting.front();
    share.place = Place{round_of(share, static_cast<double>(request->remaining_bytes())), order};
    order_.insert(*share.place);
  }

  double round_ = 0;
  KeyMap<std::unique_ptr<Share>> shares_;
  SortedBlocks<Place> order_;
};

}  // namespace

std::unique_ptr<Rule> make_fair() {
  return std::make_unique<Fair>();
}

}  // namespace pmcd::scheduler
