// SPDX-License-Identifier: MIT
// Remaining time as the key; it falls as the client is served and moves with its speed.
#include "daemon/scheduler/rules/srpt.h"

#include "daemon/scheduler/keyed_rule.h"
#include "daemon/scheduler/words.h"

namespace pmcd::scheduler {
namespace {

class Srpt final : public KeyedRule<double> {
 public:
  Srpt(SrptScope scope, const Surroundings& surroundings) : scope_(scope), surroundings_(surroundings) {}

  [[nodiscard]] std::string_view name() const override { return "srpt"; }

 private:
  [[nodiscard]] double key_of(const Request& request, const Client& client, Time) const override {
    const std::uint64_t rest = scope_ == SrptScope::mesh ? request.rest_bytes : 0;
    return static_cast<double>(request.remaining_bytes() + rest) / surroundings_.expected_speed(client);
  }
  [[nodiscard]] std::string reason(const double& key, const QueueOrder&, Time) const override {
    return seconds_text(key) + " left of the " + (scope_ == SrptScope::mesh ? "mesh" : "packet");
  }

  const SrptScope scope_;
  const Surroundings& surroundings_;
};

}  // namespace

std::unique_ptr<Rule> make_srpt(SrptScope scope, const Surroundings& surroundings) {
  return std::make_unique<Srpt>(scope, surroundings);
}

}  // namespace pmcd::scheduler
