// SPDX-License-Identifier: MIT
// FIFO is the order of the queue itself: all keys are equal.
#include "daemon/scheduler/rules/fifo.h"

#include "daemon/scheduler/keyed_rule.h"
#include "daemon/scheduler/words.h"

namespace pmcd::scheduler {
namespace {

struct Equal {
  auto operator<=>(const Equal&) const = default;
};

class Fifo final : public KeyedRule<Equal> {
 public:
  [[nodiscard]] std::string_view name() const override { return "fifo"; }

 private:
  [[nodiscard]] Equal key_of(const Request&, const Client&, Time) const override { return {}; }
  [[nodiscard]] std::string reason(const Equal&, const QueueOrder& order, Time now) const override {
    return "queued for " + age_text(order.queued_at, now);
  }
};

}  // namespace

std::unique_ptr<Rule> make_fifo() {
  return std::make_unique<Fifo>();
}

}  // namespace pmcd::scheduler
