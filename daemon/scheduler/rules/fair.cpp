// SPDX-License-Identifier: MIT
// Each session with something waiting stands under the round in which its credit will be enough, so the next one is the
// least round and nobody's credit has to be touched when a round passes.
#include "daemon/scheduler/rules/fair.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>
#include <unordered_map>

#include "daemon/scheduler/sorted_blocks.h"
#include "daemon/scheduler/words.h"

namespace pmcd::scheduler {
namespace {

class Fair final : public Rule {
 public:
  [[nodiscard]] std::string_view name() const override { return "fair"; }

  void enqueued(const Request& request, const Client& client, Time) override {
    Share& share = shares_[request.session];
    unplace(share);
    settle(share);
    share.weight = client.weight;
    share.waiting.emplace(QueueOrder::of(request), &request);
    place(share);
  }

  void removed(const Request& request) override {
    Share& share = shares_.at(request.session);
    unplace(share);
    settle(share);
    share.waiting.erase(QueueOrder::of(request));
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
      const Share& share = shares_.at(place.head.session);
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
    const auto it = shares_.find(client.session);
    if (it == shares_.end() || it->second.weight == client.weight) return;
    unplace(it->second);
    settle(it->second);
    it->second.weight = client.weight;
    place(it->second);
  }

  void started(Request& request, const Client&, Time) override {
    Share& share = shares_.at(request.session);
    const auto bytes = static_cast<double>(request.remaining_bytes());
    // Rounds pass until its credit is enough, unless it went before its time (it was very old): then it owes.
    double round = std::max(round_, round_of(share, bytes));
    unplace(share);
    if (!order_.empty()) round = std::min(round, std::max(round_, order_.front().round));
    share.credit += (round - round_) * a_round(share) - bytes;
    round_ = round;
    share.since = round_;
    share.running.emplace(request.key, request.offset_bytes);
    place(share);
  }

  void finished(const Request& request, const Client&, Outcome outcome, std::span<const Request* const>,
                Time) override {
    Share& share = shares_.at(request.session);
    const auto turn = share.running.extract(request.key);
    if (turn.empty()) return;
    const std::uint64_t end = outcome == Outcome::complete ? request.size_bytes : request.offset_bytes;
    unplace(share);
    settle(share);
    share.credit += static_cast<double>(request.size_bytes - end);
    place(share);
  }

  void session_gone(SessionKey session, Time) override {
    const auto it = shares_.find(session);
    if (it == shares_.end()) return;
    unplace(it->second);
    shares_.erase(it);
  }

 private:
  struct Place {
    double round = 0;
    QueueOrder head;
    bool operator<(const Place& other) const { return std::tie(round, head) < std::tie(other.round, other.head); }
  };
  struct Share {
    double credit = 0;  ///< bytes, at the end of round `since`
    double since = 0;
    double weight = 1;
    std::map<QueueOrder, const Request*> waiting;
    std::unordered_map<RequestKey, std::uint64_t> running;  ///< where each turn began
    std::optional<Place> place;
  };

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
    const auto& [order, request] = *share.waiting.begin();
    share.place = Place{round_of(share, static_cast<double>(request->remaining_bytes())), order};
    order_.insert(*share.place);
  }

  double round_ = 0;
  std::unordered_map<SessionKey, Share> shares_;
  SortedBlocks<Place> order_;
};

}  // namespace

std::unique_ptr<Rule> make_fair() {
  return std::make_unique<Fair>();
}

}  // namespace pmcd::scheduler
