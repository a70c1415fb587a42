// SPDX-License-Identifier: Apache-2.0
// A femur made from measures in the literature. It needs no data, and a study can have any number of different femora.
#include <algorithm>
#include <cmath>
#include <marrow/plugin.hpp>

#include "marrow/base/number_text.hpp"
#include "marrow/domain/random.hpp"
#include "marrow/simulate/femur_shape.hpp"
#include "marrow/simulate/polygonise.hpp"
#include "marrow/toolbox/phantom/phantom.hpp"

namespace {

using namespace marrow;
using phantom::Bone;

struct FemurOptions {
  double length_mm = 446;
  double head_diameter_mm = 46.6;
  double neck_shaft_deg = 122;
  double anteversion_deg = 14;
  double bow_radius_mm = 930;
  double bicondylar_width_mm = 82;
  double shaft_ml_mm = 28;
  double shaft_ap_mm = 30;
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
phantom::FemurShape drawn(const FemurOptions& options) {
  marrow::Random random(std::uint64_t(options.shape_seed), 1);
  const auto draw = [&](double mean, double spread) {
    return mean + options.variation * spread * std::clamp(random.normal(), -2.0, 2.0);
  };
  phantom::FemurShape shape;
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
  const phantom::FemurShape shape = drawn(options);
  const phantom::FemurField field(shape);
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
