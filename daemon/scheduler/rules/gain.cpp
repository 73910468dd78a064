// SPDX-License-Identifier: MIT
// Three classes in one key: base packets by size, then meshes that still look coarse by falling index, then the others
// by the time that they need.
#include "daemon/scheduler/rules/gain.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "daemon/scheduler/keyed_rule.h"
#include "daemon/scheduler/mesh_profile.h"
#include "daemon/scheduler/words.h"

namespace pmcd::scheduler {
namespace {

/// Class 0: base packet, bytes. Class 1: any other, minus its index. Class 2: of a mesh that is good enough, seconds to
/// its end.
using GainKey = std::pair<int, double>;

class Gain final : public KeyedRule<GainKey> {
 public:
  Gain(std::optional<double> until, const Surroundings& surroundings) : until_(until), surroundings_(surroundings) {}

  [[nodiscard]] std::string_view name() const override { return "gain"; }

 private:
  [[nodiscard]] GainKey key_of(const Request& request, const Client& client, Time) const override {
    // What has no profile is a mesh list: without it a client sees nothing either.
    if (request.packet == 0 || !request.profile) return {0, static_cast<double>(request.remaining_bytes())};
    const double part = share(client);
    if (until_ && request.profile->halvings(request.packet) >= *until_) {
      const double uplink = surroundings_.uplink > 0 ? surroundings_.uplink : kUnknownUplink;
      return {2, static_cast<double>(request.remaining_bytes() + request.rest_bytes) /
                     (part >= kMayFill ? uplink : part * uplink)};
    }
    return {1, -part * request.profile->steepest(request.packet, request.remaining_bytes())};
  }
  [[nodiscard]] std::string reason(const GainKey& key, const QueueOrder&, Time) const override {
    if (key.first == 0) return "base packet, " + bytes_text(static_cast<std::uint64_t>(key.second)) + " left";
    if (key.first == 2) return "good enough, " + seconds_text(key.second) + " left of the mesh";
    return "halves the error " + number_text(-key.second * 1000) + " times a kB";
  }

  /// Of the uplink that the client can take; all of it until it is measured.
  [[nodiscard]] double share(const Client& client) const {
    if (!client.speed || surroundings_.uplink <= 0) return 1;
    return std::min(1.0, *client.speed / surroundings_.uplink);
  }

  const std::optional<double> until_;  ///< halvings of the first level's error from which on a mesh is good enough
  const Surroundings& surroundings_;
};

}  // namespace

std::unique_ptr<Rule> make_gain(unsigned until_percent, const Surroundings& surroundings) {
  std::optional<double> until;
  if (until_percent > 0) until = std::log2(100.0 / until_percent);
  return std::make_unique<Gain>(until, surroundings);
}

}  // namespace pmcd::scheduler
