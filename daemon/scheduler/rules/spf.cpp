// SPDX-License-Identifier: MIT
// The key never moves.
#include "daemon/scheduler/rules/spf.h"

#include "daemon/scheduler/keyed_rule.h"
#include "daemon/scheduler/words.h"

namespace pmcd::scheduler {
namespace {

class Spf final : public KeyedRule<std::uint64_t> {
 public:
  [[nodiscard]] std::string_view name() const override { return "spf"; }

 private:
  [[nodiscard]] std::uint64_t key_of(const Request& request, const Client&, Time) const override {
    return request.size_bytes;
  }
  [[nodiscard]] std::string reason(const std::uint64_t& key, const QueueOrder&, Time) const override {
    return "packet of " + bytes_text(key);
  }
};

}  // namespace

std::unique_ptr<Rule> make_spf() {
  return std::make_unique<Spf>();
}

}  // namespace pmcd::scheduler
