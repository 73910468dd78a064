// SPDX-License-Identifier: MIT
// The key moves each time the client acknowledges something.
#include "daemon/scheduler/rules/lcfs.h"

#include "daemon/scheduler/keyed_rule.h"
#include "daemon/scheduler/words.h"

namespace pmcd::scheduler {
namespace {

class Lcfs final : public KeyedRule<std::uint64_t> {
 public:
  [[nodiscard]] std::string_view name() const override { return "lcfs"; }

 private:
  [[nodiscard]] std::uint64_t key_of(const Request&, const Client& client, Time) const override {
    return client.acknowledged;
  }
  [[nodiscard]] std::string reason(const std::uint64_t& key, const QueueOrder&, Time) const override {
    return bytes_text(key) + " received so far";
  }
};

}  // namespace

std::unique_ptr<Rule> make_lcfs() {
  return std::make_unique<Lcfs>();
}

}  // namespace pmcd::scheduler
