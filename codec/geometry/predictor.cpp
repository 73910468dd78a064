// SPDX-License-Identifier: MIT
// Every value here steers decoding: fixed order of operations, + - * / and sqrt only, every quotient guarded.
#include "codec/geometry/predictor.h"

namespace pmcd::codec {
namespace {

constexpr double kDecay = 0.998;
constexpr double kRidge = 0.5;
constexpr unsigned kSolveEvery = 16;
constexpr std::uint32_t kMaxWalkedValence = 24;
constexpr double kSmallest = 1e-6;

// The second ring as one ring vertex sees it.
struct Around {
  Vec neighbour_sum;  // of its neighbours but the centre
  double neighbours = 0;
  Vec normal;  // area-weighted
};

Around look_around(const HalfEdgeMesh& mesh, std::span<const LatticePoint> points, std::uint32_t v,
                   std::uint32_t centre, const Vec& centre_guess) {
  Around around;
  const Vec here = to_vec(points[v]);
  Vec previous;
  bool has_previous = false;
  Vec first;
  mesh.for_each_neighbour(v, [&](std::uint32_t w) {
    const bool is_centre = w == centre;
    const Vec position = is_centre ? centre_guess : to_vec(points[w]);
    if (!is_centre) {
      around.neighbour_sum = around.neighbour_sum + position;
      around.neighbours += 1;
    }
    const Vec offset = position - here;
    if (has_previous) {
      around.normal = around.normal + cross(previous, offset);
    } else {
      first = offset;
    }
    previous = offset;
    has_previous = true;
  });
  if (!mesh.is_boundary(v)) around.normal = around.normal + cross(previous, first);
  return around;
}

Vec ear_parallelogram(const HalfEdgeMesh& mesh, std::span<const LatticePoint> points, std::uint32_t ear) {
  const std::uint32_t beyond = mesh.opposite(HalfEdgeMesh::next(mesh.outgoing(ear)));
  const Vec a = to_vec(points[mesh.origin(beyond)]);
  const Vec b = to_vec(points[mesh.target(beyond)]);
  return a + b - to_vec(points[mesh.apex(beyond)]);
}

}  // namespace

void Predictor::Fit::add(const std::array<Vec, kFeatures>& feature, const Vec& target, double importance) {
  for (std::size_t i = 0; i < kFeatures; ++i) {
    for (std::size_t j = 0; j <= i; ++j) {
      matrix[i][j] = matrix[i][j] * kDecay + importance * dot(feature[i], feature[j]);
    }
    right[i] = right[i] * kDecay + importance * dot(feature[i], target);
  }
  if (until_solved == 0) {
    solve();
    until_solved = kSolveEvery;
  }
  --until_solved;
}

// Cholesky with a ridge; a system that is not positive keeps the old weights.
void Predictor::Fit::solve() {
  std::array<std::array<double, kFeatures>, kFeatures> factor{};
  std::array<double, kFeatures> solution{};
  for (std::size_t i = 0; i < kFeatures; ++i) {
    double known = right[i];
    for (std::size_t j = 0; j <= i; ++j) {
      double sum = matrix[i][j] + (i == j ? kRidge : 0);
      for (std::size_t k = 0; k < j; ++k) sum -= factor[i][k] * factor[j][k];
      if (i == j) {
        if (!(sum > kSmallest)) return;
        factor[i][i] = std::sqrt(sum);
      } else {
        factor[i][j] = sum / factor[j][j];
      }
    }
    for (std::size_t k = 0; k < i; ++k) known -= factor[i][k] * solution[k];
    solution[i] = known / factor[i][i];
  }
  for (std::size_t i = kFeatures; i-- > 0;) {
    double known = solution[i];
    for (std::size_t k = i + 1; k < kFeatures; ++k) known -= factor[k][i] * solution[k];
    solution[i] = known / factor[i][i];
  }
  weight = solution;
}

void Predictor::resize(std::size_t count) {
  spread_.resize(count);
}

Expectation Predictor::expect(const HalfEdgeMesh& mesh, std::span<const LatticePoint> points,
                              std::uint32_t centre) const {
  Expectation e;
  const bool border = mesh.is_boundary(centre);
  std::array<std::uint32_t, kMaxPatchSize> ring{};
  std::size_t size = 0;
  mesh.for_each_neighbour(centre, [&](std::uint32_t w) {
    if (size < ring.size()) ring[size++] = w;
  });
  e.group = border ? size + 2 : size - 3;
  const double share = 1.0 / static_cast<double>(size);

  Vec ring_mean;
  for (std::size_t i = 0; i < size; ++i) ring_mean = ring_mean + to_vec(points[ring[i]]);
  ring_mean = ring_mean * share;
  // A border vertex lies near the line of its border neighbours, the first and the last of the fan.
  e.mean = border ? (to_vec(points[ring[0]]) + to_vec(points[ring[size - 1]])) * 0.5 : ring_mean;

  Vec polygon;
  for (std::size_t i = 0; i < size; ++i) {
    const Vec a = to_vec(points[ring[i]]) - e.mean;
    const Vec b = to_vec(points[ring[(i + 1) % size]]) - e.mean;
    polygon = polygon + cross(a, b);
    e.radius += length(a);
    e.neighbour_tangential += static_cast<double>(spread_[ring[i]].tangential);
    e.neighbour_across += static_cast<double>(spread_[ring[i]].across);
  }
  e.radius = e.radius * share;
  if (e.radius < 0.5) e.radius = 0.5;
  e.neighbour_tangential = e.neighbour_tangential * share;
  e.neighbour_across = e.neighbour_across * share;
  const double area = length(polygon);
  if (area > kSmallest) e.normal = polygon * (1.0 / area);

  double walked = 0;
  for (std::size_t i = 0; i < size; ++i) {
    const std::uint32_t v = ring[i];
    if (mesh.face_valence(v) > kMaxWalkedValence) continue;
    const Around around = look_around(mesh, points, v, centre, e.mean);
    const Vec here = to_vec(points[v]);
    const Vec neighbour_mean = (around.neighbour_sum + e.mean) * (1.0 / (around.neighbours + 1));
    e.feature[0] = e.feature[0] + (here - neighbour_mean);
    const double normal_length = length(around.normal);
    if (normal_length > kSmallest) {
      const Vec n = around.normal * (1.0 / normal_length);
      e.feature[1] = e.feature[1] - n * dot(n, e.mean - here);
    }
    walked += 1;
  }
  if (walked > 0) {
    e.feature[0] = e.feature[0] * (1.0 / walked);
    e.feature[1] = e.feature[1] * (1.0 / walked);
  }
  if (border) {
    // An ear has no other neighbours; the parallelogram over its only face says where it points.
    e.feature[2] = (size > 2 ? ring_mean : ear_parallelogram(mesh, points, centre)) - e.mean;
  } else {
    // Parallelograms across the ring edges.
    Vec sum;
    double count = 0;
    std::uint32_t h = mesh.outgoing(centre);
    for (std::size_t i = 0; i < size; ++i) {
      const std::uint32_t across = mesh.opposite(HalfEdgeMesh::next(h));
      if (across != kNone) {
        sum = sum + (to_vec(points[mesh.origin(across)]) + to_vec(points[mesh.target(across)]) -
                     to_vec(points[mesh.apex(across)]));
        count += 1;
      }
      h = mesh.turn_left(h);
    }
    if (count > 0) e.feature[2] = sum * (1.0 / count) - e.mean;
  }

  const Fit& fit = fit_[e.group];
  Vec offset;
  for (std::size_t i = 0; i < kFeatures; ++i) offset = offset + e.feature[i] * fit.weight[i];
  const double reach = length(offset);
  const double most = 1.5 * e.radius;
  if (reach > most) offset = offset * (most / reach);
  e.position = e.mean + offset;
  e.tangential =
      e.radius * e.neighbour_tangential * (tangential_[e.group].actual / tangential_[e.group].expected) + 0.05;
  e.across = e.radius * e.neighbour_across * (across_[e.group].actual / across_[e.group].expected) + 0.05;
  return e;
}

void Predictor::learn(const Expectation& e, std::uint32_t centre, const LatticePoint& actual) {
  const Vec residual = to_vec(actual) - e.position;
  const double along = dot(residual, e.normal);
  const Vec flat = residual - e.normal * along;
  const double across = (along < 0 ? -along : along) + 0.1;
  const double tangential = length(flat) * 0.7071067811865476 + 0.1;

  const double variance = e.tangential * e.tangential + e.across * e.across + 0.1;
  fit_[e.group].add(e.feature, to_vec(actual) - e.mean, 1.0 / variance);

  auto calibrate = [](Calibration& c, double seen, double guess) {
    c.actual = c.actual * 0.99 + seen / guess;
    c.expected = c.expected * 0.99 + 1;
  };
  calibrate(tangential_[e.group], tangential, e.radius * e.neighbour_tangential + 0.05);
  calibrate(across_[e.group], across, e.radius * e.neighbour_across + 0.05);

  auto blend = [](double seen, double around) {
    const double value = 0.5 * seen + 0.5 * around;
    return static_cast<float>(value < 1e-4 ? 1e-4 : (value > 4 ? 4 : value));
  };
  spread_[centre] = {blend(tangential / e.radius, e.neighbour_tangential),
                     blend(across / e.radius, e.neighbour_across)};
}

}  // namespace pmcd::codec
