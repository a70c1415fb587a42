// SPDX-License-Identifier: Apache-2.0
#include "marrow/simulate/vertebra_shape.hpp"

#include <cmath>

namespace marrow::phantom {
namespace {

using Eigen::Vector3d;

/// Distance inside an elliptic cylinder along z, along the line from its axis.
double elliptic_wall(double x, double y, double half_width, double half_depth) {
  const double radius = std::hypot(x, y), relative = std::hypot(x / half_width, y / half_depth);
  return relative > 1e-9 ? radius - radius / relative : -half_depth;
}

/// A capsule whose cross-section is `taller` times as high (along z) as its radius.
double tall_capsule(const Vector3d& p, const Vector3d& a, const Vector3d& b, double radius, double taller) {
  const Vector3d squeeze(1, 1, 1 / taller);
  return capsule(p.cwiseProduct(squeeze), a.cwiseProduct(squeeze), b.cwiseProduct(squeeze), radius, radius);
}

}  // namespace

VertebraField::VertebraField(const VertebraShape& shape)
    : shape_(shape), scale_(shape.body_width_mm / 45), ripple_(shape.ripple_mm, 15, 30, Random(shape.seed, 8)) {}

double VertebraField::body(const Vector3d& p) const {
  const double at = 2 * p.z() / shape_.body_height_mm;  // -1 at the lower end plate, 1 at the upper one
  constexpr double kRim = 0.8;                          // what the rounding of the rims takes away
  const double in = (shape_.waist_mm + kRim) * std::max(0.0, 1 - at * at) - kRim;
  const double half_width = 0.5 * shape_.body_width_mm - in, half_depth = 0.5 * shape_.body_depth_mm - in;
  const double relative = std::hypot(p.x() / half_width, p.y() / half_depth);
  const double dish = shape_.dish_mm * std::max(0.0, 1 - 1.4 * relative * relative);
  const double plates = std::abs(p.z()) - 0.5 * shape_.body_height_mm + dish;
  return cut(elliptic_wall(p.x(), p.y(), half_width, half_depth), plates, 3);
}

double VertebraField::canal(const Vector3d& p) const {
  const double half_depth = 0.5 * shape_.canal_depth_mm;
  return elliptic_wall(p.x(), p.y() - 0.5 * shape_.body_depth_mm - half_depth, 0.5 * shape_.canal_width_mm, half_depth);
}

/// Pedicles, laminae and the seven processes. The vertebra is symmetric, so only the left half is described.
double VertebraField::arch(const Vector3d& point) const {
  const double s = scale_, back = 0.5 * shape_.body_depth_mm, behind = back + shape_.canal_depth_mm;
  const Vector3d p(std::abs(point.x()), point.y(), point.z());
  const double pedicle_radius = 0.5 * shape_.pedicle_width_mm, pedicle_x = 0.5 * shape_.canal_width_mm + pedicle_radius,
               middle_y = back + 0.5 * shape_.canal_depth_mm;
  const double pedicle = tall_capsule(p, {pedicle_x, back - 9 * s, 4 * s}, {pedicle_x, middle_y + 3 * s, 4 * s},
                                      pedicle_radius, shape_.pedicle_height_mm / shape_.pedicle_width_mm);
  const double lamina =
      tall_capsule(p, {pedicle_x - 2 * s, middle_y + 5 * s, -1 * s}, {0, behind + 3 * s, -5 * s}, 3.3 * s, 2.7);
  const double spine_radius = 3.2 * s, tip_y = shape_.length_mm - back - spine_radius;
  const double spine = tall_capsule(p, {0, behind + 4 * s, -5 * s}, {0, tip_y, -8 * s}, spine_radius, 3);
  const double transverse =
      capsule(p, {pedicle_x, middle_y + 3 * s, 4 * s},
              {0.5 * shape_.transverse_width_mm - 3.5 * s, middle_y + 7 * s, 6 * s}, 5 * s, 3.5 * s);
  const double superior = ellipsoid(p - Vector3d(pedicle_x + 1 * s, middle_y + 7 * s, 15 * s), Vector3d(6, 6, 11) * s);
  const double inferior = ellipsoid(p - Vector3d(12 * s, behind + 2 * s, -19 * s), Vector3d(6, 5.5, 11) * s);
  const double sides = join(join(pedicle, transverse, 4 * s), superior, 4 * s);
  return join(sides, join(join(lamina, spine, 4 * s), inferior, 3 * s), 3 * s);
}

double VertebraField::outer(const Vector3d& p) const {
  return ripple_.added_to(cut(join(body(p), arch(p), 3), -canal(p), 1), p);
}

Vector3d VertebraField::low_mm() const {
  return Vector3d(-0.5 * shape_.transverse_width_mm, -0.5 * shape_.body_depth_mm, -32 * scale_).array() - 8;
}
Vector3d VertebraField::high_mm() const {
  return Vector3d(0.5 * shape_.transverse_width_mm, shape_.length_mm - 0.5 * shape_.body_depth_mm, 28 * scale_)
             .array() +
         8;
}

}  // namespace marrow::phantom
