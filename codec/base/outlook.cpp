// SPDX-License-Identifier: MIT
// Every value here steers decoding: fixed order of operations, + - * / and sqrt only, every quotient guarded.
#include "codec/base/outlook.h"

#include <algorithm>
#include <cmath>

namespace pmcd::codec {
namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr double kSmallest = 1e-9;
constexpr double kDecay = 0.995;
constexpr double kRidge = 1.5;
constexpr unsigned kSolveEvery = 4;
// What the features usually weigh, see Outlook.
constexpr std::array<double, Outlook::kFeatures> kUsual = {0.8, -0.15, 0.35, 0.35};

// acos for |x| <= 1 within 7e-5 (Abramowitz and Stegun 4.4.45).
double arc_cosine(double x) {
  const double y = x < 0 ? -x : x;
  const double root = std::sqrt(y < 1 ? 1 - y : 0);
  const double angle = root * (1.5707288 + y * (-0.2121144 + y * (0.0742610 - 0.0187293 * y)));
  return x < 0 ? kPi - angle : angle;
}

// Between two directions; a right angle when one of them has none.
double angle(const Vec& a, const Vec& b) {
  const double product = length(a) * length(b);
  if (!(product > kSmallest)) return kPi / 2;
  return arc_cosine(std::clamp(dot(a, b) / product, -1.0, 1.0));
}

}  // namespace

double Vicinity::gap(const Front& front, const std::vector<LatticePoint>& points, std::uint32_t leaving) const {
  const std::uint32_t v = front.origin(leaving);
  const Vec here = to_vec(points[v]);
  const double between =
      angle(to_vec(points[front.origin(front.before(leaving))]) - here, to_vec(points[front.target(leaving)]) - here);
  // Few faces so far: the gap is the larger of the two angles between the half-edges.
  return angles_[v] < kPi ? 2 * kPi - between : between;
}

double Vicinity::urgency(const Front& front, const std::vector<LatticePoint>& points, std::uint32_t gate) const {
  return std::min(gap(front, points, gate), gap(front, points, front.after(gate)));
}

Outlook Vicinity::look(const Front& front, const std::vector<LatticePoint>& points, std::uint32_t gate) const {
  Outlook o;
  const std::uint32_t before = front.before(gate);
  const std::uint32_t after = front.after(gate);
  const Vec a = to_vec(points[front.origin(gate)]);
  const Vec b = to_vec(points[front.target(gate)]);
  const Vec c = to_vec(points[front.apex(gate)]);
  const Vec p = to_vec(points[front.origin(before)]);
  const Vec n = to_vec(points[front.target(after)]);
  o.middle = (a + b) * 0.5;
  o.length = (length(b - a) + length(c - b) + length(a - c)) * (1.0 / 3);
  if (o.length < 0.5) o.length = 0.5;
  const Vec normal = cross(b - a, c - a);
  const double area = length(normal);
  if (area > kSmallest) o.normal = normal * (1.0 / area);

  o.left.gap = gap(front, points, gate);
  o.right.gap = gap(front, points, after);
  o.feature[0] = o.middle - c;
  o.feature[1] = o.normal * length(o.feature[0]);
  // A gap of two faces: their common vertex makes a parallelogram with the three around the gap.
  auto two_faces = [](double gap_here) { return std::max(0.0, 1 - std::abs(gap_here * (3 / kPi) - 2)); };
  if (front.is_open(before)) o.feature[2] = (p + b - a - o.middle - o.feature[0]) * two_faces(o.left.gap);
  if (front.is_open(after)) o.feature[3] = (n + a - b - o.middle - o.feature[0]) * two_faces(o.right.gap);
  const bool open_left = front.is_open(before);
  const bool open_right = front.is_open(after);
  o.exact_known = {true, open_left, open_right, true, true, true, open_left, open_right};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::array<double, Outlook::kExact> exact = {
        (a + b - c)[axis], (p + b - a)[axis], (n + a - b)[axis], a[axis], b[axis], c[axis], p[axis], n[axis]};
    for (std::size_t kind = 0; kind < exact.size(); ++kind) o.exact[kind][axis] = exact[kind];
  }
  Vec offset;
  for (std::size_t i = 0; i < kFeatures; ++i) offset = offset + o.feature[i] * (kUsual[i] + change_[i]);
  const double reach = length(offset);
  const double most = 2.5 * o.length;
  if (!(reach < 1e15)) {
    offset = o.feature[0];
  } else if (reach > most) {
    offset = offset * (most / reach);
  }
  o.position = o.middle + offset;
  o.tangential = o.length * (tangential_ / seen_) + 0.02;
  o.across = o.length * (across_ / seen_) + 0.02;

  const bool has_left = front.is_open(before) && front.origin(before) != front.target(gate);
  const bool has_right = front.is_open(after) && front.target(after) != front.origin(gate);
  const bool three = has_left && has_right && front.origin(before) == front.target(after);
  const bool four = has_left && has_right && front.before(before) == front.after(after);
  auto close_at = [&](Side& side, std::uint32_t vertex, std::uint32_t entry, std::uint32_t corner, const Vec& here,
                      const Vec& there, std::uint32_t far_corner) {
    if (vertex == front.apex(gate)) return;
    // The face's third edge: from the far end to the other corner (in the orientation of the new face).
    if (corner == front.origin(gate) ? front.runs(vertex, far_corner) : front.runs(far_corner, vertex)) return;
    side.vertex = vertex;
    side.entry = entry;
    const Vec q = to_vec(points[vertex]);
    const Vec face = corner == front.origin(gate) ? cross(here - there, q - there) : cross(there - here, q - here);
    const double size = length(face);
    const double bend = size > kSmallest ? dot(face, o.normal) * (1.0 / size) : 0;
    const double miss = std::min(4.0, length(q - o.position) / o.length);
    const std::uint32_t here_faces = front.face_valence(corner);
    const std::uint32_t far_faces = front.face_valence(vertex);
    // A logistic fit over the bases of twenty scans and machine parts, 24 to 1,500 vertices each.
    side.closing = -0.43 * side.gap - 0.49 * miss + 0.67 * std::max(0.0, miss - 0.7) -
                   0.94 * std::min(4.0, length(q - there) / o.length) +
                   0.47 * std::min(4.0, length(q - here) / o.length) + 0.44 * bend + (here_faces == 2 ? 0.57 : 0) +
                   (here_faces == 3 ? 0.19 : 0) - (three ? 0.91 : 0) + (four ? 0.23 : 0) -
                   0.30 * std::min(8.0, 2 * kPi - angles_[corner] - angle(here - there, q - here)) +
                   0.14 * std::min(8.0, angles_[vertex]) + (far_faces == 1 ? 0.56 : 0) + (far_faces == 2 ? 0.16 : 0);
  };
  const std::uint32_t av = front.origin(gate);
  const std::uint32_t bv = front.target(gate);
  if (has_left) close_at(o.left, front.origin(before), before, av, a, b, bv);
  if (has_right) close_at(o.right, front.target(after), front.after(after), bv, b, a, av);
  return o;
}

void Vicinity::add_face(const Face& face, const std::vector<LatticePoint>& points) {
  angles_.resize(points.size(), 0);
  for (std::size_t i = 0; i < 3; ++i) {
    const Vec here = to_vec(points[face[i]]);
    angles_[face[i]] += angle(to_vec(points[face[(i + 1) % 3]]) - here, to_vec(points[face[(i + 2) % 3]]) - here);
  }
}

void Vicinity::learn(const Outlook& o, const LatticePoint& actual) {
  const Vec residual = to_vec(actual) - o.position;
  const double along = dot(residual, o.normal);
  const Vec flat = residual - o.normal * along;
  tangential_ = tangential_ * kDecay + std::min(4.0, length(flat) * 0.6 / o.length);
  across_ = across_ * kDecay + std::min(4.0, std::abs(along) / o.length);
  seen_ = seen_ * kDecay + 1;

  Vec target = to_vec(actual) - o.middle;
  for (std::size_t i = 0; i < kFeatures; ++i) target = target - o.feature[i] * kUsual[i];
  const double importance = 1.0 / (o.length * o.length);
  for (std::size_t i = 0; i < kFeatures; ++i) {
    for (std::size_t j = 0; j <= i; ++j) {
      matrix_[i][j] = matrix_[i][j] * kDecay + importance * dot(o.feature[i], o.feature[j]);
    }
    right_[i] = right_[i] * kDecay + importance * dot(o.feature[i], target);
  }
  if (until_solved_-- > 0) return;
  until_solved_ = kSolveEvery - 1;
  // Cholesky; the ridge keeps it positive.
  std::array<std::array<double, kFeatures>, kFeatures> factor{};
  std::array<double, kFeatures> solution{};
  for (std::size_t i = 0; i < kFeatures; ++i) {
    double known = right_[i];
    for (std::size_t j = 0; j <= i; ++j) {
      double sum = matrix_[i][j] + (i == j ? kRidge : 0);
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
  change_ = solution;
}

}  // namespace pmcd::codec
