// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <algorithm>
#include <functional>
#include <span>
#include <utility>

#include "marrow/domain/mesh.hpp"
#include "marrow/domain/random.hpp"

namespace marrow::phantom {

/// The surface field = 0 by marching tetrahedra on a grid of `spacing_mm`. It is always closed and oriented outward.
/// `field` must be continuous, negative inside, positive on the border of the box, and safe to call from several
/// threads. It must not change by more than `steepest` per mm: blocks of the grid that cannot reach the surface are
/// skipped.
Mesh polygonise(const std::function<double(const Eigen::Vector3d&)>& field, const Eigen::Vector3d& low_mm,
                const Eigen::Vector3d& high_mm, double spacing_mm, double steepest);

// Continuous shapes as functions that are negative inside and about the distance in mm near the surface.

using Node = std::pair<double, double>;

/// Piecewise linear curve through nodes, constant beyond them.
inline double along(std::span<const Node> nodes, double x) {
  if (x <= nodes.front().first) return nodes.front().second;
  for (std::size_t i = 1; i < nodes.size(); ++i)
    if (x <= nodes[i].first) {
      const double t = (x - nodes[i - 1].first) / (nodes[i].first - nodes[i - 1].first);
      return nodes[i - 1].second + t * (nodes[i].second - nodes[i - 1].second);
    }
  return nodes.back().second;
}

/// The same with rounded corners, by averaging over +-0.025.
inline double smooth_along(std::span<const Node> nodes, double x) {
  constexpr double kHalfWidth = 0.025;
  double sum = 0;
  for (int i = -2; i <= 2; ++i) sum += along(nodes, x + i * kHalfWidth / 2);
  return sum / 5;
}

/// Union and intersection with a fillet of about `fillet` mm (polynomial smooth minimum).
inline double join(double a, double b, double fillet) {
  const double h = std::max(fillet - std::abs(a - b), 0.0) / fillet;
  return std::min(a, b) - h * h * fillet / 4;
}
inline double cut(double a, double b, double fillet) { return -join(-a, -b, fillet); }

inline double ellipsoid(const Eigen::Vector3d& p, const Eigen::Vector3d& radii) {
  const double k0 = p.cwiseQuotient(radii).norm(), k1 = p.cwiseQuotient(radii.cwiseProduct(radii)).norm();
  return k1 > 1e-9 ? k0 * (k0 - 1) / k1 : -radii.minCoeff();
}

/// A disc with its axis along x and rounded rims.
inline double disc(const Eigen::Vector3d& p, double radius, double half_width, double rim) {
  const double across = std::hypot(p.y(), p.z()) - (radius - rim), beside = std::abs(p.x()) - (half_width - rim);
  return std::hypot(std::max(across, 0.0), std::max(beside, 0.0)) + std::min(std::max(across, beside), 0.0) - rim;
}

/// A cone with rounded ends between two points.
inline double capsule(const Eigen::Vector3d& p, const Eigen::Vector3d& a, const Eigen::Vector3d& b, double radius_a,
                      double radius_b) {
  const double t = std::clamp((p - a).dot(b - a) / (b - a).squaredNorm(), 0.0, 1.0);
  return (p - a - t * (b - a)).norm() - (radius_a + t * (radius_b - radius_a));
}

/// Smooth irregularities of a surface: a sum of waves in random directions. Its root mean square is about `amplitude`.
class Ripple {
 public:
  /// The waves are from `shortest` to `shortest` + `range` mm long.
  Ripple(double amplitude, double shortest, double range, Random random) : amplitude_(amplitude) {
    for (Wave& wave : waves_) {
      const Eigen::Vector3d direction(random.normal(), random.normal(), random.normal());
      wave = {direction.normalized() * 2 * 3.14159265358979323846 / (shortest + range * random.uniform_above_0()),
              2 * 3.14159265358979323846 * random.uniform_above_0()};
    }
  }
  /// The field of a shape with the irregularities, if `field` is that without them at the point.
  double added_to(double field, const Eigen::Vector3d& point) const {
    if (!(amplitude_ > 0) || !(std::abs(field) < 20)) return field;
    double sum = 0;
    for (const Wave& wave : waves_) sum += std::sin(wave.number.dot(point) + wave.phase);
    return field + amplitude_ * sum / std::sqrt(0.5 * double(waves_.size()));
  }

 private:
  struct Wave {
    Eigen::Vector3d number;
    double phase;
  };
  double amplitude_;
  std::array<Wave, 12> waves_;
};

}  // namespace marrow::phantom
