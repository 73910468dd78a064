// SPDX-License-Identifier: MIT
// Three-component double arithmetic for prediction and legality: + - * / and sqrt only, in a fixed order, so that
// every IEEE build gives the same bits. No SIMD, no general linear algebra.
#pragma once

#include <array>
#include <cfloat>
#include <cmath>
#include <cstddef>
#include <cstdint>

namespace pmcd::codec {

static_assert(FLT_EVAL_METHOD == 0, "the codec's predictions need plain double arithmetic");

struct Vec {
  double x = 0;
  double y = 0;
  double z = 0;

  double& operator[](std::size_t axis) { return axis == 0 ? x : (axis == 1 ? y : z); }
  double operator[](std::size_t axis) const { return axis == 0 ? x : (axis == 1 ? y : z); }
};

inline Vec operator+(const Vec& a, const Vec& b) {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}
inline Vec operator-(const Vec& a, const Vec& b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
inline Vec operator*(const Vec& a, double k) {
  return {a.x * k, a.y * k, a.z * k};
}
inline double dot(const Vec& a, const Vec& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
inline Vec cross(const Vec& a, const Vec& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
inline double length(const Vec& a) {
  return std::sqrt(dot(a, a));
}

inline Vec to_vec(const std::array<std::int32_t, 3>& p) {
  return {static_cast<double>(p[0]), static_cast<double>(p[1]), static_cast<double>(p[2])};
}

}  // namespace pmcd::codec
