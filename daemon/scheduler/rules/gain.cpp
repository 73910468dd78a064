// SPDX-License-Identifier: MIT
// Two classes in one key: base packets by size, then the others by falling index.
#include "daemon/scheduler/rules/gain.h"

#include <algorithm>
#include <utility>

#include "daemon/scheduler/keyed_rule.h"
#include "daemon/scheduler/mesh_profile.h"
#include "daemon/scheduler/words.h"

namespace pmcd::scheduler {
namespace {

/// Class 0: base packet, bytes. Class 1: any other, minus its index.
using GainKey = std::pair<int, double>;

class Gain final : public KeyedRule<GainKey> {
 public:
  explicit Gain(const Surroundings& surroundings) : surroundings_(surroundings) {}

  [[nodiscard]] std::string_view name() const override { return "gain"; }

 private:
  [[nodiscard]] GainKey key_of(const Request& request, const Client& client, Time) const override {
    // What has no profile is a mesh list: without it a client sees nothing either.
    if (request.packet == 0 || !request.profile) return {0, static_cast<double>(request.remaining_bytes())};
    const double share =
        client.speed && surroundings_.uplink > 0 ? std::min(1.0, *client.speed / surroundings_.uplink) : 1.0;
    return {1, -share * request.profile->steepest(request.packet, request.remaining_bytes())};
  }
  [[nodiscard]] std::string reason(const GainKey& key, const QueueOrder&, Time) const override {
    if (key.first == 0) return "base packet, " + bytes_text(static_cast<std::uint64_t>(key.second)) + " left";
    return "halves the error " + number_text(-key.second * 1000) + " times a kB";
  }

  const Surroundings& surroundings_;
};

}  // namespace

std::unique_ptr<Rule> make_gain(const Surroundings& surroundings) {
  return std::make_unique<Gain>(surroundings);
}

}  // namespace pmcd::scheduler
