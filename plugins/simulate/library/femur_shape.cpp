// SPDX-License-Identifier: Apache-2.0
#include "marrow/simulate/femur_shape.hpp"

#include <cmath>

namespace marrow::phantom {
namespace {

using Eigen::Vector3d;

// Width and depth relative to the mid-shaft value, over the fraction of the length from the distal end (measured on 24
// femora).
constexpr std::array<Node, 13> kWidth{{{0.05, 2.2},
                                       {0.09, 2.05},
                                       {0.13, 1.68},
                                       {0.20, 1.31},
                                       {0.25, 1.186},
                                       {0.30, 1.096},
                                       {0.35, 1.04},
                                       {0.45, 1.0},
                                       {0.55, 1.007},
                                       {0.65, 1.04},
                                       {0.75, 1.12},
                                       {0.83, 1.32},
                                       {0.88, 1.50}}};
constexpr std::array<Node, 12> kDepth{{{0.05, 1.40},
                                       {0.09, 1.35},
                                       {0.13, 1.22},
                                       {0.20, 1.07},
                                       {0.25, 1.033},
                                       {0.30, 1.007},
                                       {0.35, 0.993},
                                       {0.50, 1.0},
                                       {0.60, 0.993},
                                       {0.75, 1.033},
                                       {0.83, 1.08},
                                       {0.88, 1.12}}};
// Height of the linea aspera relative to its largest.
constexpr std::array<Node, 6> kLinea{{{0.22, 0.0}, {0.32, 0.6}, {0.42, 1.0}, {0.62, 1.0}, {0.72, 0.7}, {0.82, 0.0}}};
// Half the canal's width relative to the isthmus: canal flare index about 3.7 (Noble et al., CORR 1988).
constexpr std::array<Node, 9> kCanal{{{0.06, 12.0},
                                      {0.12, 4.5},
                                      {0.20, 2.35},
                                      {0.30, 1.45},
                                      {0.42, 1.0},
                                      {0.60, 1.0},
                                      {0.75, 1.5},
                                      {0.83, 2.6},
                                      {0.90, 12.0}}};

// Half the width of the distal end before it is scaled. Its parts are placed for this width.
constexpr double kHalfWidthMm = 41;
// How far the rearmost point of the medial condyle lies from that of the lateral one: to the medial side, and to the
// back. Anteversion is measured from the line through these points.
constexpr double kCondylesApartMm = 49.5, kCondylesRiseMm = 4;

}  // namespace

FemurField::FemurField(const FemurShape& shape)
    : shape_(shape),
      scale_(0.5 * shape.bicondylar_width_mm / kHalfWidthMm),
      ripple_(shape.ripple_mm, 35, 65, Random(shape.seed, 7)) {
  const double head_radius = 0.5 * shape.head_diameter_mm;
  const double out = shape.neck_length_mm * std::sin(shape.neck_shaft_rad),
               up = -shape.neck_length_mm * std::cos(shape.neck_shaft_rad);
  const double z = shape.length_mm - head_radius;
  neck_base_ = {0, bow(z - up), z - up};
  const double forward_rad = shape.anteversion_rad - std::atan2(kCondylesRiseMm, kCondylesApartMm);
  head_ = neck_base_ + Vector3d(out * std::cos(forward_rad), -out * std::sin(forward_rad), up);
  // Parts swell where they are joined to each other and to the shaft. So the whole is wider than the parts.
  for (int round = 0; round < 5; ++round) scale_ *= shape.bicondylar_width_mm / distal_width_mm();
}

double FemurField::distal_width_mm() const {
  // No part of the distal end is wider than its epicondyles, which lie around here.
  const double behind = bow(0.06 * shape_.length_mm) - 4;
  const auto reaches = [&](double x) {
    for (double z = 18 * scale_; z <= 48 * scale_; z += 1)
      for (double y = behind - 14 * scale_; y <= behind + 22 * scale_; y += 1)
        if (outer_at({x, y, z}) <= 0) return true;
    return false;
  };
  double width = 0;
  for (const double side : {-1.0, 1.0}) {
    double inside = 0.7 * kHalfWidthMm * scale_, outside = 1.3 * kHalfWidthMm * scale_;
    for (int step = 0; step < 14; ++step) {
      const double middle = 0.5 * (inside + outside);
      (reaches(side * middle) ? inside : outside) = middle;
    }
    width += inside;
  }
  return width;
}

/// The y coordinate (towards the back) of the shaft's axis: an arc, convex to the front, with y = 0 at a fifth of the
/// length.
double FemurField::bow(double z) const {
  const double middle = 0.52 * shape_.length_mm, reference = 0.2 * shape_.length_mm;
  return ((z - middle) * (z - middle) - (reference - middle) * (reference - middle)) / (2 * shape_.bow_radius_mm);
}

Vector3d FemurField::anatomical(const Vector3d& point) const {
  return {shape_.medial_x * point.x(), point.y(), point.z()};
}

double FemurField::shaft(const Vector3d& p) const {
  const double at = p.z() / shape_.length_mm;
  const double ridge = shape_.linea_aspera_mm * smooth_along(kLinea, at);
  const double half_width = 0.5 * shape_.shaft_ml_mm * smooth_along(kWidth, at);
  const double half_depth = 0.5 * (shape_.shaft_ap_mm * smooth_along(kDepth, at) - ridge);
  const double x = p.x(), y = p.y() - bow(p.z()) + 0.5 * ridge;
  const double angle = std::atan2(x, y);  // 0 = straight back
  const double grown = std::exp(-0.5 * angle * angle / (0.24 * 0.24)) * ridge;
  const double radius = std::hypot(x, y), relative = std::hypot(x / half_width, y / half_depth);
  const double wall = relative > 1e-9 ? radius - radius / relative - grown : -half_depth;
  return cut(wall, std::max(0.055 * shape_.length_mm - p.z(), p.z() - neck_base_.z() - 4), 8);
}

double FemurField::distal(const Vector3d& p) const {
  const double s = scale_, half = kHalfWidthMm * s;
  const double axis = bow(0.06 * shape_.length_mm) - 4;
  const Vector3d q(p.x(), p.y() - axis, p.z());
  // Each condyle is two discs, a smaller one at the back and a larger one at the front, because its radius of curvature
  // increases to the front.
  const double medial_x = half - 16 * s, lateral_x = -half + 17 * s;
  const double medial = join(disc(q - Vector3d(medial_x, 17 * s, 21 * s), 20.5 * s, 14 * s, 9 * s),
                             disc(q - Vector3d(medial_x - 2 * s, -2 * s, 26 * s), 26 * s, 14 * s, 10 * s), 8 * s);
  const double lateral = join(disc(q - Vector3d(lateral_x, 14 * s, 23.5 * s), 19.5 * s, 14.5 * s, 9 * s),
                              disc(q - Vector3d(lateral_x + 1 * s, -6 * s, 30 * s), 28 * s, 15 * s, 9 * s), 8 * s);
  const double trochlea = ellipsoid(q - Vector3d(-2 * s, -9 * s, 33 * s), Vector3d(30, 22, 21) * s);
  const double epicondyles = std::min(ellipsoid(q - Vector3d(half - 9 * s, 4 * s, 33 * s), Vector3d(7, 11, 12) * s),
                                      ellipsoid(q - Vector3d(-half + 9 * s, 5 * s, 30 * s), Vector3d(7, 10, 10) * s));
  double all = join(join(medial, lateral, 4 * s), join(trochlea, epicondyles, 4 * s), 9 * s);
  const double notch = ellipsoid(q - Vector3d(0, 20 * s, 8 * s), Vector3d(11, 26, 25) * s);
  all = cut(all, -notch, 5 * s);
  const double groove =
      capsule(q, Vector3d(-2 * s, -42 * s, 20 * s), Vector3d(-2 * s, -45 * s, 60 * s), 11 * s, 11 * s);
  return cut(all, -groove, 6 * s);
}

double FemurField::proximal(const Vector3d& p) const {
  const double s = shape_.head_diameter_mm / 46.6;
  const double head = (p - head_).norm() - 0.5 * shape_.head_diameter_mm;
  const double neck = capsule(p, neck_base_, head_, 17 * s, 14 * s);
  const Vector3d foot(0, bow(neck_base_.z()), 0);
  const double greater =
      ellipsoid(p - foot - Vector3d(-19 * s, 7 * s, neck_base_.z() + 6 * s), Vector3d(14, 18, 27) * s);
  const double lesser = ellipsoid(p - foot - Vector3d(13 * s, 15 * s, head_.z() - 54 * s), Vector3d(9, 9, 13) * s);
  const double crest = capsule(p, foot + Vector3d(-16 * s, 20 * s, neck_base_.z() + 14 * s),
                               foot + Vector3d(11 * s, 17 * s, head_.z() - 50 * s), 5 * s, 5 * s);
  return join(join(join(head, neck, 6 * s), greater, 12 * s), join(lesser, crest, 5 * s), 8 * s);
}

double FemurField::outer_at(const Vector3d& p) const {
  double field = shaft(p);
  if (p.z() < 0.3 * shape_.length_mm) field = join(field, distal(p), 14 * scale_);
  if (p.z() > 0.65 * shape_.length_mm) field = join(field, proximal(p), 12);
  return field;
}

double FemurField::outer(const Vector3d& point) const {
  const Vector3d p = anatomical(point);
  return ripple_.added_to(outer_at(p), p);
}

double FemurField::inner(const Vector3d& point) const {
  const Vector3d p = anatomical(point);
  const double canal = std::hypot(p.x(), p.y() - bow(p.z()) + 0.3 * shape_.linea_aspera_mm) -
                       0.5 * shape_.canal_mm * smooth_along(kCanal, p.z() / shape_.length_mm);
  return cut(outer(point) + shape_.shell_mm, canal, 3);
}

Vector3d FemurField::low_mm() const { return Vector3d(-70 * scale_ - 20, -70, -12); }
Vector3d FemurField::high_mm() const { return Vector3d(70 * scale_ + 20, 90, shape_.length_mm + 12); }

}  // namespace marrow::phantom
