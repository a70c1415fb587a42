// SPDX-License-Identifier: Apache-2.0
#pragma once
// Differences of a signed distance at a voxel, which are computed from a tile of 8 x 8 x 8 voxels with one more voxel
// all around. Each function takes a pointer to the voxel's value in these 10 x 10 x 10 values.
#include <Eigen/Core>
#include <algorithm>
#include <cmath>

namespace marrow::segment {

inline constexpr int kX = 1, kY = 10, kZ = 100;  // steps to the neighbours within a halo

/// Gradient by central differences, per mm, in the grid's own axes.
inline Eigen::Vector3f gradient(const float* v, const Eigen::Vector3f& per_mm) {
  return Eigen::Vector3f(v[kX] - v[-kX], v[kY] - v[-kY], v[kZ] - v[-kZ]).cwiseProduct(0.5f * per_mm);
}

/// div(grad / |grad|), per mm; positive for a ball.
inline float curvature(const float* v, const Eigen::Vector3f& per_mm, const Eigen::Vector3f& g) {
  const auto second = [&](int s, int k) { return (v[s] - 2 * v[0] + v[-s]) * per_mm[k] * per_mm[k]; };
  const auto mixed = [&](int s, int t, int k, int l) {
    return (v[s + t] - v[s - t] - v[t - s] + v[-s - t]) * 0.25f * per_mm[k] * per_mm[l];
  };
  const float xx = second(kX, 0), yy = second(kY, 1), zz = second(kZ, 2);
  const float squared = g.squaredNorm();
  const float numerator = xx * (g.y() * g.y() + g.z() * g.z()) + yy * (g.x() * g.x() + g.z() * g.z()) +
                          zz * (g.x() * g.x() + g.y() * g.y()) -
                          2 * (g.x() * g.y() * mixed(kX, kY, 0, 1) + g.x() * g.z() * mixed(kX, kZ, 0, 2) +
                               g.y() * g.z() * mixed(kY, kZ, 1, 2));
  return numerator / (squared * std::sqrt(squared));
}

/// |grad| by Godunov's upwind differences. The sign of `speed` says which way the front moves.
inline float upwind_gradient(const float* v, const Eigen::Vector3f& per_mm, float speed) {
  float sum = 0;
  const int steps[3] = {kX, kY, kZ};
  for (int k = 0; k < 3; ++k) {
    const float back = (v[0] - v[-steps[k]]) * per_mm[k], ahead = (v[steps[k]] - v[0]) * per_mm[k];
    const float first = speed > 0 ? std::max(back, 0.f) : std::min(back, 0.f);
    const float second = speed > 0 ? std::min(ahead, 0.f) : std::max(ahead, 0.f);
    sum += first * first + second * second;
  }
  return std::sqrt(sum);
}

/// Smallest solution of |grad u| = 1 given the neighbours' distances (Rouy and Tourin, SIAM J. Numer. Anal. 1992).
/// Without branches, so that the compiler computes several voxels at once.
inline float eikonal(const float* v, float sign, const Eigen::Vector3f& per_mm) {
  const auto nearest = [&](int step) { return std::max(0.f, std::min(sign * v[step], sign * v[-step])); };
  float a = nearest(kX), b = nearest(kY), c = nearest(kZ);
  float of_a = per_mm.x() * per_mm.x(), of_b = per_mm.y() * per_mm.y(), of_c = per_mm.z() * per_mm.z();
  const auto sort = [](float& p, float& q, float& of_p, float& of_q) {
    const float least = q < p ? q : p, most = q < p ? p : q, of_least = q < p ? of_q : of_p,
                of_most = q < p ? of_p : of_q;
    p = least, q = most, of_p = of_least, of_q = of_most;
  };
  sort(a, b, of_a, of_b);
  sort(b, c, of_b, of_c);
  sort(a, b, of_a, of_b);
  // The solution with one, two or three axes: a further axis counts if its neighbour is nearer than the solution so
  // far.
  const auto solution = [](float p, float q, float r) { return (q + std::sqrt(std::max(0.f, q * q - p * r))) / p; };
  const float p1 = of_a, q1 = of_a * a, r1 = of_a * a * a - 1, first = solution(p1, q1, r1);
  const float p2 = p1 + of_b, q2 = q1 + of_b * b, r2 = r1 + of_b * b * b, second = solution(p2, q2, r2);
  const float third = solution(p2 + of_c, q2 + of_c * c, r2 + of_c * c * c);
  const float further = second > c ? third : second;
  return first > b ? further : first;
}

inline bool beside_surface(const float* v) {
  const bool inside = v[0] < 0;
  bool differs = false;
  for (int step : {kX, -kX, kY, -kY, kZ, -kZ}) differs |= (v[step] < 0) != inside;
  return differs;
}

}  // namespace marrow::segment
