// SPDX-License-Identifier: Apache-2.0
// A femur made from measures in the literature. It needs no data, and a study can have any number of different femora.
#include <marrow/plugin.hpp>

#include "marrow/simulate/polygonise.hpp"
#include "marrow/toolbox/phantom/phantom.hpp"

namespace {

using namespace marrow;
using namespace marrow::phantom;

/// Parameters of a femur. Defaults are means from the literature. Anteversion: the angle between the neck's axis and
/// the line that touches both condyles at the back, seen along the shaft. Bicondylar width: across both condyles and
/// epicondyles, along this line.
struct FemurShape {
  double length_mm = 446;
  double head_diameter_mm = 46.6;
  double neck_length_mm = 50;  ///< from the shaft's axis to the head's centre
  double neck_shaft_rad = 122 * 3.14159265358979323846 / 180;
  double anteversion_rad = 14 * 3.14159265358979323846 / 180;
  double bow_radius_mm = 930;
  double bicondylar_width_mm = 82;
  double shaft_ml_mm = 28;
  double shaft_ap_mm = 30;
  double canal_mm = 12.3;
  double linea_aspera_mm = 3.5;
  double shell_mm = 1.6;  ///< thickness of the cortex at both ends
  double medial_x = -1;   ///< -1: a left femur (its head points to the patient's right); +1: a right femur
  double ripple_mm = 0;   ///< amplitude of smooth irregularities of the surface
  std::uint64_t seed = 1;
};

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

/// The femur as two continuous fields, negative inside. Near the surface they are about the distance in mm. Points are
/// in frame "bone", with the distal end at z = 0 and the shaft's axis near x = y = 0. Safe to use from several threads.
class FemurField {
 public:
  explicit FemurField(const FemurShape& shape)
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

  double outer(const Vector3d& point) const {
    const Vector3d p = anatomical(point);
    return ripple_.added_to(outer_at(p), p);
  }

  /// The endosteal surface: a narrow canal along the shaft, and shell_mm inside the outer surface at the ends.

  double inner(const Vector3d& point) const {
    const Vector3d p = anatomical(point);
    const double canal = std::hypot(p.x(), p.y() - bow(p.z()) + 0.3 * shape_.linea_aspera_mm) -
                         0.5 * shape_.canal_mm * smooth_along(kCanal, p.z() / shape_.length_mm);
    return cut(outer(point) + shape_.shell_mm, canal, 3);
  }

  /// Corners of a box that contains the femur.
  Vector3d low_mm() const { return Vector3d(-70 * scale_ - 20, -70, -12); }
  Vector3d high_mm() const { return Vector3d(70 * scale_ + 20, 90, shape_.length_mm + 12); }

 private:
  /// (medial, back, up)
  Vector3d anatomical(const Vector3d& point) const { return {shape_.medial_x * point.x(), point.y(), point.z()}; }

  double outer_at(const Vector3d& p) const {
    double field = shaft(p);
    if (p.z() < 0.3 * shape_.length_mm) field = join(field, distal(p), 14 * scale_);
    if (p.z() > 0.65 * shape_.length_mm) field = join(field, proximal(p), 12);
    return field;
  }

  double shaft(const Vector3d& p) const {
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

  double distal(const Vector3d& p) const {
    const double s = scale_, half = kHalfWidthMm * s;
    const double axis = bow(0.06 * shape_.length_mm) - 4;
    const Vector3d q(p.x(), p.y() - axis, p.z());
    // Each condyle is two discs, a smaller one at the back and a larger one at the front, because its radius of
    // curvature increases to the front.
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

  double proximal(const Vector3d& p) const {
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

  /// The y coordinate (towards the back) of the shaft's axis: an arc, convex to the front, with y = 0 at a fifth of the
  /// length.
  double bow(double z) const {
    const double middle = 0.52 * shape_.length_mm, reference = 0.2 * shape_.length_mm;
    return ((z - middle) * (z - middle) - (reference - middle) * (reference - middle)) / (2 * shape_.bow_radius_mm);
  }

  /// across both condyles and epicondyles
  double distal_width_mm() const {
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

  FemurShape shape_;
  double scale_;  ///< of the distal end, for the bicondylar width that is asked for
  Eigen::Vector3d head_, neck_base_;
  Ripple ripple_;
};

struct FemurOptions {
  double length_mm = 446;
  double head_diameter_mm = 46.6;
  double neck_shaft_deg = 122;
  double anteversion_deg = 14;
  double bow_radius_mm = 930;
  double bicondylar_width_mm = 82;
  double shaft_ml_mm = 28, shaft_ap_mm = 30;
  double canal_diameter_mm = 12.3;
  double linea_aspera_mm = 3.5;
  std::string side = "left";
  int shape_seed = 1;
  double variation = 0;
  double ripple_mm = 0.3;
  double resolution_mm = 1.2;
  double isocentre_from_distal_end_mm = 70;
  double thigh_radius_mm = 80;
  double fat_mm = 12;
};

/// Draws each measure from a normal distribution with the variation between people, cut at 2 standard deviations.
FemurShape drawn(const FemurOptions& options) {
  marrow::Random random(std::uint64_t(options.shape_seed), 1);
  const auto draw = [&](double mean, double spread) {
    return mean + options.variation * spread * std::clamp(random.normal(), -2.0, 2.0);
  };
  FemurShape shape;
  shape.length_mm = draw(options.length_mm, 26.6);
  // Widths are correlated with length. Half of the variation is common.
  const double size = shape.length_mm / options.length_mm;
  shape.head_diameter_mm = size * draw(options.head_diameter_mm, 2.5);
  shape.neck_length_mm = size * draw(50, 3);
  shape.neck_shaft_rad = radians(draw(options.neck_shaft_deg, 5.5));
  shape.anteversion_rad = radians(draw(options.anteversion_deg, 8));
  shape.bow_radius_mm = draw(options.bow_radius_mm, 120);
  shape.bicondylar_width_mm = size * draw(options.bicondylar_width_mm, 4);
  shape.shaft_ml_mm = size * draw(options.shaft_ml_mm, 1.8);
  shape.shaft_ap_mm = size * draw(options.shaft_ap_mm, 1.8);
  shape.canal_mm = draw(options.canal_diameter_mm, 1.8);
  shape.linea_aspera_mm = draw(options.linea_aspera_mm, 0.7);
  shape.ripple_mm = options.ripple_mm;
  shape.medial_x = options.side == "left" ? -1 : 1;
  shape.seed = std::uint64_t(options.shape_seed);
  return shape;
}

Bone femur(const FemurOptions& options, Context& context) {
  if (options.canal_diameter_mm + 4 > std::min(options.shaft_ml_mm, options.shaft_ap_mm))
    throw Error(
        formatted("simulate.femur: a canal of {:f} mm leaves less than 2 mm of cortex in a shaft of {:f} mm; make the "
                  "canal narrower",
                  options.canal_diameter_mm, std::min(options.shaft_ml_mm, options.shaft_ap_mm)));
  const FemurShape shape = drawn(options);
  const FemurField field(shape);
  constexpr double kSteepest = 2;
  Bone bone;
  context.progress(0, "outer surface");
  bone.outer = phantom::polygonise([&](const Eigen::Vector3d& p) { return field.outer(p); }, field.low_mm(),
                                   field.high_mm(), options.resolution_mm, kSteepest);
  context.check_cancelled();
  context.progress(0.6, "inner surface");
  bone.inner = phantom::polygonise([&](const Eigen::Vector3d& p) { return field.inner(p); }, field.low_mm(),
                                   field.high_mm(), options.resolution_mm, kSteepest);
  bone.outer.frame = bone.inner.frame = "bone";
  // Cancellous bone of 200-500 HU at both ends, only marrow in the canal.
  const double length = shape.length_mm;
  bone.fill_z_mm = {0, 0.06 * length, 0.16 * length, 0.24 * length, 0.74 * length, 0.84 * length, length};
  bone.fill_fraction = {0.30, 0.24, 0.15, 0, 0, 0.16, 0.30};
  bone.thigh_radius_mm = options.thigh_radius_mm;
  bone.fat_mm = options.fat_mm;
  phantom::place_distal_end(bone, options.isocentre_from_distal_end_mm);
  bone.thigh_centre_mm = Eigen::Vector2d::Zero();
  phantom::check_bone(bone, "simulate.femur");
  return bone;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("simulate.femur", femur)
      .summary("Makes a femur from published measures, with condyles, trochanters, bow, linea aspera, cortex and canal")
      .out("bone", "bone with a closed outer and a closed inner surface")
      .option("length_mm", &FemurOptions::length_mm, "length from the condyles to the top of the head", at_least(250),
              at_most(600))
      .option("head_diameter_mm", &FemurOptions::head_diameter_mm, "diameter of the femoral head", at_least(30),
              at_most(65))
      .option("neck_shaft_deg", &FemurOptions::neck_shaft_deg, "angle between neck and shaft", at_least(100),
              at_most(150))
      .option("anteversion_deg", &FemurOptions::anteversion_deg,
              "angle of the neck's axis to the front of the line that touches both condyles at the back", at_least(-20),
              at_most(50))
      .option("bow_radius_mm", &FemurOptions::bow_radius_mm, "radius of the shaft's bow, convex to the front",
              at_least(400))
      .option("bicondylar_width_mm", &FemurOptions::bicondylar_width_mm, "width across both condyles and epicondyles",
              at_least(55), at_most(110))
      .option("shaft_ml_mm", &FemurOptions::shaft_ml_mm, "mid-shaft diameter, medial to lateral", at_least(18),
              at_most(45))
      .option("shaft_ap_mm", &FemurOptions::shaft_ap_mm,
              "mid-shaft diameter, front to back, including the linea aspera", at_least(18), at_most(45))
      .option("canal_diameter_mm", &FemurOptions::canal_diameter_mm,
              "diameter of the marrow canal at its narrowest place", at_least(4), at_most(30))
      .option("linea_aspera_mm", &FemurOptions::linea_aspera_mm,
              "height of the linea aspera, the ridge on the back of the shaft", at_least(0), at_most(8))
      .option("side", &FemurOptions::side, "left or right femur", one_of({"left", "right"}))
      .option("shape_seed", &FemurOptions::shape_seed, "seed of the variation and of the irregularities", at_least(0))
      .option("variation", &FemurOptions::variation,
              "0: exactly these measures; 1: random measures around them, with the variation between people",
              at_least(0), at_most(1))
      .option("ripple_mm", &FemurOptions::ripple_mm, "amplitude of smooth irregularities of the surface", at_least(0),
              at_most(2))
      .option("resolution_mm", &FemurOptions::resolution_mm,
              "edge length of the cubes in which the surface is made into triangles", at_least(0.3), at_most(4))
      .option("isocentre_from_distal_end_mm", &FemurOptions::isocentre_from_distal_end_mm,
              "height of the isocentre (origin) above the distal end")
      .option("thigh_radius_mm", &FemurOptions::thigh_radius_mm, "radius of the soft tissue around the bone; 0: none",
              at_least(0))
      .option("fat_mm", &FemurOptions::fat_mm, "thickness of the layer of fat", at_least(0));
}
