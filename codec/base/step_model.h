// SPDX-License-Identifier: MIT
// What lies beyond a half-edge of the growing base mesh, as a few binary decisions: the boundary? a face that closes
// the gap on one side? a new vertex? else which known vertex, by its distance from where a new one is expected.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include "codec/base/front.h"
#include "codec/base/outlook.h"
#include "codec/base/primed.h"
#include "codec/entropy/integer_model.h"
#include "codec/source.h"

namespace pmcd::codec {

/// A binary decision whose log odds are known roughly; learns what they are worth.
class OddsModel {
 public:
  OddsModel() {
    // A decision primed by n of one kind has odds of about n + 1.
    double ones = 1;
    for (std::size_t i = kBuckets / 2; i < kBuckets; ++i) {
      for (unsigned n = 1; n < ones; ++n) {
        model_[i].update(true);
        model_[kBuckets - 1 - i].update(false);
      }
      ones = std::min(60.0, ones * 1.6487212707);
    }
  }
  template <typename Source>
  bool code(Source& source, double log_odds, bool value) {
    const double place = std::clamp(log_odds * 2 + static_cast<double>(kBuckets) / 2, 0.0, kBuckets - 1.0);
    return source.bit(model_[static_cast<std::size_t>(place)], value);
  }

 private:
  static constexpr std::size_t kBuckets = 21;  // half a unit each
  std::array<AdaptiveBit, kBuckets> model_;
};

class StepModel {
 public:
  struct Step {
    BaseStep::Kind kind = BaseStep::Kind::boundary;
    std::uint32_t entry = kNone;  ///< of Front::attach
  };

  /// Codes `wanted` (writing) or reads what lies beyond the gate. `points` holds every vertex of the front.
  /// False: damaged data.
  template <typename Source>
  bool code(Source& source, const Front& front, const std::vector<LatticePoint>& points, const Outlook& outlook,
            std::uint32_t gate, bool has_boundary, const Step& wanted, Step& step) {
    using Kind = BaseStep::Kind;
    if (has_boundary) {
      const std::size_t beside =
          (front.is_boundary(front.before(gate)) ? 1u : 0u) + (front.is_boundary(front.after(gate)) ? 1u : 0u);
      if (source.bit(boundary_[beside], wanted.kind == Kind::boundary)) {
        step = {Kind::boundary, kNone};
        return true;
      }
    }
    step.kind = Kind::known_vertex;
    const bool right_first = outlook.right.closing > outlook.left.closing;
    for (const bool right : {right_first, !right_first}) {
      const Side& side = right ? outlook.right : outlook.left;
      if (side.vertex == kNone) continue;
      const Side& other = right ? outlook.left : outlook.right;
      if (right != right_first && other.entry == side.entry) continue;  // a chain of three: asked already
      step.entry = side.entry;
      if (closing_[right != right_first ? 1 : 0].code(source, side.closing,
                                                      wanted.kind == Kind::known_vertex && wanted.entry == step.entry))
        return true;
    }
    find_others(front, points, outlook, gate);
    if (others_.empty() && looked_at_ <= kMostLookedAt) {
      step = {Kind::new_vertex, kNone};
      return true;
    }
    double odds = 3;
    if (!others_.empty()) {
      const double nearest = std::min(4.0, std::sqrt(static_cast<double>(others_.front().first)) / outlook.length);
      odds = 1.53 * nearest + 1.22 * std::max(0.0, nearest - 0.5) - 0.66 * std::max(0.0, nearest - 1.2) - 0.35;
    }
    if (new_.code(source, odds, wanted.kind == Kind::new_vertex)) {
      step = {Kind::new_vertex, kNone};
      return true;
    }
    std::uint32_t rank = 0;
    if (looked_at_ <= kMostLookedAt) {
      const auto found =
          std::find_if(others_.begin(), others_.end(), [&](const auto& other) { return other.second == wanted.entry; });
      rank = static_cast<std::uint32_t>(found - others_.begin());
      if (found != others_.end() && rank >= nearest_) {
        const auto nearer = [&](const auto& other) { return other < *found; };
        rank = static_cast<std::uint32_t>(std::count_if(others_.begin(), others_.end(), nearer));
      }
      rank = rank_.code(source, rank);
      if (rank >= others_.size()) return false;
      if (rank >= nearest_) {
        const auto rest = others_.begin() + static_cast<std::ptrdiff_t>(nearest_);
        std::nth_element(rest, others_.begin() + static_cast<std::ptrdiff_t>(rank), others_.end());
      }
      step.entry = others_[rank].second;
      return true;
    }
    unsigned bits = 0;
    while ((std::uint64_t{1} << bits) < 3 * std::uint64_t{front.face_count()}) ++bits;
    step.entry = source.raw(wanted.entry, bits);
    return step.entry < 3 * front.face_count() && front.on_border(step.entry);
  }

 private:
  static constexpr std::uint64_t kMostLookedAt = 1u << 24;
  static constexpr std::size_t kNearest = 16;

  // Ways to attach to the rest of the border, nearest first.
  void find_others(const Front& front, const std::vector<LatticePoint>& points, const Outlook& outlook,
                   std::uint32_t gate) {
    others_.clear();
    looked_at_ += front.open().size();
    if (looked_at_ > kMostLookedAt) return;
    std::array<std::int64_t, 3> from{};
    for (std::size_t axis = 0; axis < 3; ++axis) from[axis] = static_cast<std::int64_t>(outlook.position[axis]);
    auto add = [&](std::uint32_t entry) {
      const std::uint32_t v = front.origin(entry);
      if (v == front.origin(gate) || v == front.target(gate) || v == front.apex(gate) || v == outlook.left.vertex ||
          v == outlook.right.vertex)
        return;
      std::int64_t square = 0;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const std::int64_t d = points[v][axis] - from[axis];
        square += d * d;
      }
      others_.push_back({square, entry});
    };
    for (const std::uint32_t h : front.open()) {
      add(h);
      if (front.is_boundary(front.after(h))) add(front.after(h));
    }
    // The nearest in order, without those that would make an edge anew; the rest as they come.
    nearest_ = std::min<std::size_t>(kNearest, others_.size());
    const auto some = others_.begin() + static_cast<std::ptrdiff_t>(nearest_);
    std::partial_sort(others_.begin(), some, others_.end());
    const auto kept = std::remove_if(others_.begin(), some, [&](const auto& other) {
      const std::uint32_t v = front.origin(other.second);
      return front.runs(front.origin(gate), v) || front.runs(v, front.target(gate));
    });
    nearest_ = static_cast<std::size_t>(kept - others_.begin());
    others_.erase(kept, some);
  }

  std::array<AdaptiveBit, 3> boundary_;
  std::array<OddsModel, 2> closing_;
  OddsModel new_;
  UnsignedModel rank_;
  std::vector<std::pair<std::int64_t, std::uint32_t>> others_;  // squared distance, entry
  std::size_t nearest_ = 0;                                     // so many of them are in order
  std::uint64_t looked_at_ = 0;
};

}  // namespace pmcd::codec
