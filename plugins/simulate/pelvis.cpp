// SPDX-License-Identifier: Apache-2.0
// A plain pelvis: wide, with wings, rings and two sockets, and nearly the same from the left and from the right.
#include <marrow/plugin.hpp>

#include "marrow/simulate/polygonise.hpp"
#include "marrow/toolbox/phantom/phantom.hpp"

namespace {

using namespace marrow;
using Eigen::Vector3d;
using phantom::Bone, phantom::capsule, phantom::cut, phantom::ellipsoid, phantom::join;

struct PelvisOptions {
  int shape_seed = 1;
  double variation = 0;
  double width_mm = 256, height_mm = 210;
  double depth_mm = 150;
  double socket_diameter_mm = 50;
  double shell_mm = 1.5;
  double ripple_mm = 0.5;
  double cancellous_fraction = 0.2;
  double resolution_mm = 2;
  double tissue_radius_mm = 170;
  double fat_mm = 25;
};

/// Measures that differ between people.
struct PelvisShape {
  Vector3d scale = Vector3d::Ones();  ///< of the mean pelvis along x, y, z
  double flare_rad = 0.45;            ///< by which the wings lean outwards
  double socket_radius_mm = 25;
};

PelvisShape drawn(const PelvisOptions& options) {
  constexpr double kMeanWidth_mm = 256, kMeanDepth_mm = 150, kMeanHeight_mm = 210;
  Random random(std::uint64_t(options.shape_seed), 5);
  const auto draw = [&](double mean, double part) {
    return mean * (1 + options.variation * part * std::clamp(random.normal(), -2.0, 2.0));
  };
  PelvisShape shape;
  shape.scale = Vector3d(draw(options.width_mm / kMeanWidth_mm, 0.06), draw(options.depth_mm / kMeanDepth_mm, 0.06),
                         draw(options.height_mm / kMeanHeight_mm, 0.05));
  shape.flare_rad = draw(shape.flare_rad, 0.2);
  shape.socket_radius_mm = draw(0.5 * options.socket_diameter_mm, 0.06);
  return shape;
}

/// The wing of the ilium: a thin ellipsoid that leans outwards; its back reaches the sacrum.
double wing(const Vector3d& p, double flare_rad) {
  const Eigen::Matrix3d turn =
      (Eigen::AngleAxisd(0.5, Vector3d::UnitZ()) * Eigen::AngleAxisd(flare_rad, Vector3d::UnitY())).toRotationMatrix();
  return ellipsoid(turn.transpose() * (p - Vector3d(88, 8, 62)), {8, 62, 66});
}

/// Negative inside the bone. Both halves are alike, so only the left one is described. The origin is in the middle
/// between the sockets.
double outer(const Vector3d& point, const PelvisShape& shape) {
  const Vector3d scaled = point.cwiseQuotient(shape.scale), p(std::abs(scaled.x()), scaled.y(), scaled.z());
  const double about_socket = ellipsoid(p - Vector3d(72, 2, 4), {27, 34, 36});
  const double upper_ramus = capsule(p, {62, -14, -4}, {6, -48, -28}, 11, 9);
  const double ischium = capsule(p, {74, 18, -18}, {62, 26, -66}, 18, 15);
  const double lower_ramus = capsule(p, {58, 14, -70}, {6, -44, -44}, 8, 8);
  const double sacrum = capsule(p.cwiseProduct(Vector3d(0.6, 1, 1)), {0, 58, 66}, {0, 76, -34}, 24, 8);
  const double sacral_wing = capsule(p, {20, 58, 62}, {64, 52, 58}, 20, 15);
  double field = join(about_socket, wing(p, shape.flare_rad), 14);
  field = join(join(field, upper_ramus, 8), ischium, 8);
  field = join(join(field, lower_ramus, 6), join(sacrum, sacral_wing, 10), 8);
  const double socket = (p - Vector3d(93, 0, 0)).norm() - shape.socket_radius_mm;
  return shape.scale.minCoeff() * cut(field, -socket, 2);
}

Bone pelvis(const PelvisOptions& options, Context& context) {
  const PelvisShape shape = drawn(options);
  const phantom::Ripple ripple(options.ripple_mm, 20, 40, Random(std::uint64_t(options.shape_seed), 6));
  const auto field = [&](const Vector3d& p) { return ripple.added_to(outer(p, shape), p); };
  const Vector3d low = shape.scale.cwiseProduct(Vector3d(-165, -90, -105)),
                 high = shape.scale.cwiseProduct(Vector3d(165, 125, 150));
  constexpr double kSteepest = 2;
  Bone bone;
  context.progress(0, "outer surface");
  bone.outer = phantom::polygonise(field, low, high, options.resolution_mm, kSteepest);
  context.check_cancelled();
  context.progress(0.5, "inner surface");
  bone.inner = phantom::polygonise([&](const Vector3d& p) { return field(p) + options.shell_mm; }, low, high,
                                   options.resolution_mm, kSteepest);
  bone.outer.frame = bone.inner.frame = "bone";
  bone.fill_fraction = {options.cancellous_fraction};
  bone.thigh_radius_mm = options.tissue_radius_mm;
  bone.fat_mm = options.fat_mm;
  phantom::check_bone(bone, "simulate.pelvis");
  return bone;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("simulate.pelvis", pelvis)
      .summary(
          "Makes a plain pelvis of about the usual measures: wings, sockets, pubic and ischial rami, sacrum; the "
          "middle between the sockets is the isocentre")
      .out("bone", "bone with a closed outer and a closed inner surface")
      .option("width_mm", &PelvisOptions::width_mm, "greatest width, between the crests", at_least(200), at_most(340))
      .option("height_mm", &PelvisOptions::height_mm, "greatest height", at_least(160), at_most(270))
      .option("depth_mm", &PelvisOptions::depth_mm, "from the pubic symphysis to the back of the sacrum", at_least(110),
              at_most(200))
      .option("socket_diameter_mm", &PelvisOptions::socket_diameter_mm, "diameter of the sockets", at_least(40),
              at_most(62))
      .option("shell_mm", &PelvisOptions::shell_mm, "thickness of the cortical bone", at_least(0.5), at_most(4))
      .option("cancellous_fraction", &PelvisOptions::cancellous_fraction,
              "share of bone inside the cortical bone; the rest is marrow", at_least(0), at_most(1), unit(""))
      .option("shape_seed", &PelvisOptions::shape_seed, "seed of the variation and of the irregularities", at_least(0))
      .option("variation", &PelvisOptions::variation,
              "0: exactly these measures; 1: random measures around them, as between people", at_least(0), at_most(1))
      .option("ripple_mm", &PelvisOptions::ripple_mm, "amplitude of smooth irregularities of the surface", at_least(0),
              at_most(1))
      .option("resolution_mm", &PelvisOptions::resolution_mm,
              "edge length of the cubes in which the surface is made into triangles", at_least(0.5), at_most(6))
      .option("tissue_radius_mm", &PelvisOptions::tissue_radius_mm,
              "radius of the soft tissue around the isocentre; 0: none", at_least(0))
      .option("fat_mm", &PelvisOptions::fat_mm, "thickness of the layer of fat", at_least(0));
}
