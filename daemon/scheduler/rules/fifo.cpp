// SPDX-License-Identifier: MIT
// FIFO as an ordered set: requests may leave from anywhere (a session that goes), so a plain queue would not do.
#include "daemon/scheduler/rules/fifo.h"

#include <set>

namespace pmcd::scheduler {
namespace {

class Fifo final : public Rule {
 public:
  [[nodiscard]] std::string_view name() const override { return "fifo"; }

  void enqueued(const Request& request) override { waiting_.insert(QueueOrder::of(request)); }
  void removed(const Request& request) override { waiting_.erase(QueueOrder::of(request)); }

  [[nodiscard]] std::optional<RequestKey> next() const override {
    if (waiting_.empty()) return std::nullopt;
    return waiting_.begin()->key;
  }

 private:
  std::set<QueueOrder> waiting_;
};

}  // namespace

std::unique_ptr<Rule> make_fifo() {
  return std::make_unique<Fifo>();
}

}  // namespace pmcd::scheduler
