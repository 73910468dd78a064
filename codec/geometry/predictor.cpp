// SPDX-License-Identifier: MIT
// Every value here steers decoding: fixed order of operations, + - * / and sqrt only, every quotient guarded.
#include "codec/geometry/predictor.h"

#include <utility>

namespace pmcd::codec {
namespace {

constexpr double kSmallest = 1e-6;
constexpr LeastSquares<Expectation::kFeatures, 1>::Tuning kTuning{0.998, 4, 16};
constexpr std::array<double, Expectation::kFeatures> kPrior{0.3, 0.3, 0, 0, 0, 0, 0};

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

// By axis the median of the corners: one crease does not bend it. Counting who is smaller needs no branches.
Vec median(std::span<const LatticePoint> corners) {
  Vec median{};
  const std::size_t count = corners.size();
  for (std::size_t axis = 0; axis < 3; ++axis) {
    std::int64_t twice = 0;
    for (std::size_t i = 0; i < count; ++i) {
      const std::int32_t value = corners[i][axis];
      std::size_t smaller = 0;
      std::size_t same_before = 0;
      for (std::size_t j = 0; j < count; ++j) smaller += corners[j][axis] < value ? 1u : 0u;
      for (std::size_t j = 0; j < i; ++j) same_before += corners[j][axis] == value ? 1u : 0u;
      const std::size_t rank = smaller + same_before;
      twice += (rank == count / 2 ? std::int64_t{value} : 0) + (rank == (count - 1) / 2 ? std::int64_t{value} : 0);
    }
    median[axis] = 0.5 * static_cast<double>(twice);
  }
  return median;
}

}  // namespace

Predictor::Predictor()
    : position_(copies_of<std::array<PositionFit, kGroups>, kStages>(
          copies_of<PositionFit, kGroups>(PositionFit(kTuning, {kPrior})))) {}

Expectation Predictor::expect(const HalfEdgeMesh& mesh, std::span<const LatticePoint> points, const Surface& surface,
                              std::uint32_t centre, unsigned shift, std::size_t stage) const {
  Expectation e;
  e.stage = stage;
  e.cell = static_cast<double>(2u << shift);
  e.ring = collect_ring(mesh, centre);
  const Ring& ring = e.ring;
  e.group = group_of(ring);
  const std::size_t size = ring.size;
  const double share = 1.0 / static_cast<double>(size);

  std::array<Vec, Ring::kMost> at;
  Vec ring_mean{};
  for (std::size_t i = 0; i < size; ++i) {
    at[i] = to_vec(points[ring.vertex[i]]);
    ring_mean = ring_mean + at[i];
  }
  ring_mean = ring_mean * share;
  // A border vertex lies near the line of its border neighbours, the first and the last of the fan.
  e.mean = ring.border ? (at[0] + at[size - 1]) * 0.5 : ring_mean;

  SpreadModel::Signs signs;
  Vec polygon{};
  Vec parallelograms{};
  Vec bilaplacian{};
  Vec normals{};
  Vec near_mean{};
  double near_sum = 0;
  Vec long_mean{};  // weighted by the ring edges at the vertex
  double perimeter = 0;
  std::array<Vec, Ring::kMost> spoke;
  std::array<double, Ring::kMost> edge;
  std::array<LatticePoint, Ring::kMost> corner;  // fourth corners of the parallelograms over the ring edges
  std::size_t corners = 0;
  for (std::size_t i = 0; i < size; ++i) spoke[i] = at[i] - e.mean;
  for (std::size_t i = 0; i < size; ++i) {
    const std::size_t next = ring.after(i);
    polygon = polygon + cross(spoke[i], spoke[next]);
    edge[i] = length(at[next] - at[i]);
    if (ring.apex[i] == kNone) continue;
    const LatticePoint& a = points[ring.vertex[i]];
    const LatticePoint& b = points[ring.vertex[next]];
    const LatticePoint& apex = points[ring.apex[i]];
    for (std::size_t axis = 0; axis < 3; ++axis) corner[corners][axis] = a[axis] + b[axis] - apex[axis];
    parallelograms = parallelograms + (to_vec(corner[corners]) - e.mean);
    ++corners;
  }
  for (std::size_t i = 0; i < size; ++i) {
    const double distance = length(spoke[i]);
    signs.radius += distance;
    const double nearness = 1 / (distance + 2);
    near_mean = near_mean + spoke[i] * nearness;
    near_sum += nearness;
    const double edges = edge[i] + edge[i == 0 ? size - 1 : i - 1];
    long_mean = long_mean + spoke[i] * edges;
    perimeter += edges;
    const RingSums& around = surface[ring.vertex[i]];
    signs.neighbours.tangential += static_cast<double>(around.tangential);
    signs.neighbours.across += static_cast<double>(around.across);
    bilaplacian = bilaplacian + (at[i] - around.neighbour_mean());
    const Vec n = around.normal_vector();
    const double square = dot(n, n);
    if (square > kSmallest) normals = normals + n * (dot(n, spoke[i]) / square);
  }
  signs.radius = signs.radius * share;
  if (signs.radius < 1) signs.radius = 1;
  e.radius = signs.radius;
  const double area = length(polygon);
  if (area > kSmallest) e.normal = polygon * (1.0 / area);

  e.feature[0] = bilaplacian * share;
  e.feature[1] = normals * share;
  if (ring.border) {
    // An ear has no other neighbours; the parallelogram over its only face says where it points.
    e.feature[2] = size > 2 || corners == 0 ? ring_mean - e.mean : parallelograms;
  } else {
    if (corners > 0) {
      e.feature[2] = parallelograms * (1.0 / static_cast<double>(corners));
      e.feature[3] = median({corner.data(), corners}) - e.mean;
    }
    // Between the two opposite neighbours that are nearest to each other.
    double least = 0;
    for (std::size_t i = 0; i < size; ++i) {
      const std::size_t opposite = i + size / 2 < size ? i + size / 2 : i + size / 2 - size;
      const Vec across = at[i] - at[opposite];
      const double square = dot(across, across);
      if (i > 0 && square >= least) continue;
      least = square;
      e.feature[4] = (spoke[i] + spoke[opposite]) * 0.5;
    }
    e.feature[5] = long_mean * (1 / (perimeter + 2));
  }
  e.feature[6] = near_mean * (1.0 / near_sum);

  const auto& weight = position_[stage][e.group].weight(0);
  Vec offset{};
  for (std::size_t i = 0; i < Expectation::kFeatures; ++i) offset = offset + e.feature[i] * weight[i];
  const double reach = length(offset);
  const double most = 1.5 * signs.radius;
  if (reach > most) offset = offset * (most / reach);
  e.position = e.mean + offset;

  signs.neighbours.tangential *= signs.radius * share;
  signs.neighbours.across *= signs.radius * share;
  for (std::size_t i = 0; i < size; ++i) {
    const double height = dot(spoke[i], e.normal);
    signs.unevenness += height * height;
  }
  signs.unevenness = std::sqrt(signs.unevenness * share);
  const double along = dot(e.feature[2], e.normal);
  const double bend = dot(e.feature[0], e.normal);
  signs.parallelogram_across = along < 0 ? -along : along;
  signs.parallelogram_tangential = length(e.feature[2] - e.normal * along);
  signs.crowding = length(e.feature[6]);
  signs.bend = bend < 0 ? -bend : bend;
  e.spread_terms = SpreadModel::terms(signs, 1.0 / e.cell);
  e.spread = spread_[stage].expect(e.spread_terms, e.group);
  return e;
}

void Predictor::learn(const Expectation& e, std::uint32_t centre, const LatticePoint& actual, Surface& surface) {
  const Vec point = to_vec(actual);
  const Vec target = point - e.mean;
  const double cells = e.spread.tangential * e.spread.tangential + e.spread.across * e.spread.across;
  position_[e.stage][e.group].observe(
      1.0 / (cells * e.cell * e.cell + 0.4),
      [&](std::size_t i, std::size_t j) { return dot(e.feature[i], e.feature[j]); },
      [&](std::size_t /*target*/, std::size_t i) { return dot(e.feature[i], target); });

  const Vec residual = point - e.position;
  const double along = dot(residual, e.normal);
  const double inverse = 1.0 / e.cell;
  const Spread seen{length(residual - e.normal * along) * (0.7071067811865476 * inverse),
                    (along < 0 ? -along : along) * inverse};
  spread_[e.stage].learn(e.spread_terms, e.group, e.spread, seen);
  if (e.stage == kFurtherDigits) return;

  // Relative to the ring's size, so that it means the same for the next level.
  const double unit = e.cell / e.radius;
  auto relative = [&](double value) {
    const double bounded = (value + 0.1) * unit;
    return static_cast<float>(bounded < 1e-4 ? 1e-4 : (bounded > 4 ? 4 : bounded));
  };
  surface[centre].tangential = relative(seen.tangential);
  surface[centre].across = relative(seen.across);
}

}  // namespace pmcd::codec
