// SPDX-License-Identifier: MIT
// Every value here steers decoding: single precision, fixed order of operations, + - * / and sqrt only, every quotient
// guarded.
#include "codec/geometry/predictor.h"

#include <utility>

#include "codec/geometry/lanes.h"

namespace pmcd::codec {
namespace {

using Fit = Expectation::Fit;

constexpr float kSmallest = 1e-6f;
constexpr Fit::Tuning kPositionTuning{0.998f, 4, 32};
constexpr Fit::Weights kPositionPrior{0.3f, 0.3f, 0, 0, 0};

template <typename Element, std::size_t Count>
std::array<Element, Count> copies_of(const Element& element) {
  return [&]<std::size_t... I>(std::index_sequence<I...> /*counting*/) {
    return std::array<Element, Count>{(static_cast<void>(I), element)...};
  }
  (std::make_index_sequence<Count>());
}

std::size_t group_of(const Ring& ring) {
  if (ring.border) return ring.size < 4 ? ring.size + 4 : 8;
  return ring.size < 8 ? ring.size - (ring.size < 3 ? ring.size : 3) : 5;
}

// Lane by lane the median of the first `count` values, which are sorted for it.
Four median(std::array<Four, Ring::kMost>& values, std::size_t count) {
  for (std::size_t i = 1; i < count; ++i) {
    // Into those before it: each keeps the smaller and hands on the larger.
    Four handed = values[i];
    for (std::size_t j = 0; j < i; ++j) {
      const Four least = smaller(values[j], handed);
      handed = larger(values[j], handed);
      values[j] = least;
    }
    values[i] = handed;
  }
  return 0.5f * (values[(count - 1) / 2] + values[count / 2]);
}

float absolute(float value) {
  return value < 0 ? -value : value;
}

}  // namespace

Predictor::Predictor()
    : position_(copies_of<std::array<Fit, kGroups>, kStages>(
          copies_of<Fit, kGroups>(Fit(kPositionTuning, {kPositionPrior})))) {}

Expectation Predictor::expect(const Ring& ring, const Surface& surface, std::uint32_t centre, unsigned shift,
                              std::size_t stage) const {
  Expectation e;
  e.stage = stage;
  e.cell = static_cast<float>(2u << shift);
  e.origin = surface[centre].point;
  const FourWords origin = four_words(e.origin);
  e.group = group_of(ring);
  const std::size_t size = ring.size;
  const float share = 1.0f / static_cast<float>(size);

  std::array<Four, Ring::kMost> at;
  Four ring_mean{};
  for (std::size_t i = 0; i < size; ++i) {
    at[i] = surface[ring.vertex[i]].seen_from(origin);
    ring_mean += at[i];
  }
  ring_mean *= share;
  // A border vertex lies near the line of its border neighbours, the first and the last of the fan.
  e.mean = ring.border ? 0.5f * (at[0] + at[size - 1]) : ring_mean;

  SpreadModel::Signs signs;
  std::array<Four, Ring::kMost> corner;  // fourth corners of the parallelograms over the ring edges
  std::size_t corners = 0;
  Four polygon{};
  Four parallelograms{};
  Four bilaplacian{};
  Four normals{};
  Four near_mean{};
  float near_sum = 0;
  for (std::size_t i = 0; i < size; ++i) {
    const std::size_t next = ring.after(i);
    const Four spoke = at[i] - e.mean;
    polygon += cross(spoke, at[next] - e.mean);
    const float distance = length(spoke);
    signs.radius += distance;
    const float nearness = 1 / (distance + 2);
    near_mean += spoke * nearness;
    near_sum += nearness;
    const Site& site = surface[ring.vertex[i]];
    signs.neighbours.tangential += site.spread.tangential;
    signs.neighbours.across += site.spread.across;
    bilaplacian += at[i] - site.neighbour_mean(origin);
    normals += site.normal * dot(site.normal, spoke);

    if (ring.apex[i] == kNone) continue;
    corner[corners] = at[i] + at[next] - surface[ring.apex[i]].seen_from(origin) - e.mean;
    parallelograms += corner[corners];
    ++corners;
  }
  signs.radius *= share;
  if (signs.radius < 1) signs.radius = 1;
  e.radius = signs.radius;
  const float area = length(polygon);
  if (area > kSmallest) e.normal = polygon * (1.0f / area);

  std::array<Four, Expectation::kFeatures> feature{};
  feature[0] = bilaplacian * share;
  feature[1] = normals * share;
  if (ring.border) {
    // An ear has no other neighbours; the parallelogram over its only face says where it points.
    feature[2] = size > 2 || corners == 0 ? ring_mean - e.mean : parallelograms;
  } else {
    if (corners > 0) {
      feature[2] = parallelograms * (1.0f / static_cast<float>(corners));
      feature[3] = median(corner, corners);  // one crease does not bend it
    }
  }
  feature[4] = near_mean * (1 / near_sum);

  const Fit::Weights& weight = position_[stage][e.group].weight(0);
  Four offset{};
  for (std::size_t i = 0; i < Expectation::kFeatures; ++i) {
    offset += feature[i] * weight[i];
    for (std::size_t axis = 0; axis < 3; ++axis) e.equation[axis].value[i] = feature[i][axis];
  }
  const float reach = length(offset);
  const float most = 1.5f * signs.radius;
  if (reach > most) offset *= most / reach;
  e.position = e.mean + offset;

  signs.neighbours.tangential *= signs.radius * share;
  signs.neighbours.across *= signs.radius * share;
  for (std::size_t i = 0; i < size; ++i) {
    const float height = dot(at[i] - e.mean, e.normal);
    signs.unevenness += height * height;
  }
  signs.unevenness = std::sqrt(signs.unevenness * share);
  const float along = dot(feature[2], e.normal);
  signs.parallelogram_across = absolute(along);
  signs.parallelogram_tangential = length(feature[2] - e.normal * along);
  signs.crowding = length(feature[4]);
  signs.bend = absolute(dot(feature[0], e.normal));
  e.spread_terms = SpreadModel::terms(signs, 1.0f / e.cell);
  e.spread = spread_[stage].expect(e.spread_terms, e.group);
  return e;
}

RelativeSpread Predictor::learn(const Expectation& e, const LatticePoint& actual) {
  const Four point{static_cast<float>(actual[0] - e.origin[0]), static_cast<float>(actual[1] - e.origin[1]),
                   static_cast<float>(actual[2] - e.origin[2]), 0};
  const Four target = point - e.mean;
  std::array<Fit::Equation, 3> equation = e.equation;
  for (std::size_t axis = 0; axis < 3; ++axis) equation[axis].value[Expectation::kFeatures] = target[axis];
  const float cells = e.spread.tangential * e.spread.tangential + e.spread.across * e.spread.across;
  position_[e.stage][e.group].observe(1.0f / (cells * e.cell * e.cell + 0.4f), equation);

  const Four residual = point - e.position;
  const float along = dot(residual, e.normal);
  const float inverse = 1.0f / e.cell;
  const Spread seen{length(residual - e.normal * along) * (0.70710678f * inverse), absolute(along) * inverse};
  spread_[e.stage].learn(e.spread_terms, e.group, e.spread, seen);

  // Relative to the ring's size, so that it means the same for the next level.
  const float unit = e.cell / e.radius;
  auto relative = [&](float value) {
    const float bounded = (value + 0.1f) * unit;
    return bounded < 1e-4f ? 1e-4f : (bounded > 4 ? 4.0f : bounded);
  };
  return {relative(seen.tangential), relative(seen.across)};
}

}  // namespace pmcd::codec
