// SPDX-License-Identifier: Apache-2.0
// The femoral part of a knee replacement: a shell around the end of the femur, nearly the same for both sides.
#include <algorithm>
#include <cmath>
#include <marrow/plugin.hpp>

#include "marrow/domain/random.hpp"
#include "marrow/simulate/polygonise.hpp"
#include "marrow/simulate/shape_functions.hpp"
#include "marrow/toolbox/phantom/phantom.hpp"

namespace {

using namespace marrow;
using Eigen::Vector3d;
using phantom::Bone;
using phantom::cut, phantom::join;

struct ImplantOptions {
  int shape_seed = 1;
  double variation = 0;
  double width_mm = 66;
  double depth_mm = 62;
  double height_mm = 56;
  double thickness_mm = 9;
  double resolution_mm = 0.8;
  double tissue_radius_mm = 60;
  double fat_mm = 8;
};

ImplantOptions drawn(ImplantOptions options) {
  Random random(std::uint64_t(options.shape_seed), 7);
  for (double* measure : {&options.width_mm, &options.depth_mm, &options.height_mm, &options.thickness_mm})
    *measure *= 1 + options.variation * 0.08 * std::clamp(random.normal(), -2.0, 2.0);
  return options;
}

/// Negative inside an elliptic cylinder along x with this middle and half width.
double roller(const Vector3d& p, double middle_x, double half_width, double radius_y, double radius_z) {
  const double radius = std::hypot(p.y(), p.z()), relative = std::hypot(p.y() / radius_y, p.z() / radius_z);
  const double across = relative > 1e-9 ? radius - radius / relative : -std::min(radius_y, radius_z);
  return cut(across, std::abs(p.x() - middle_x) - half_width, 4);
}

/// Negative inside the implant: two condyles and the flange in front, without the five plane cuts of the bone, and with
/// two pegs. The outer condyle is narrower and the flange leans towards it, so that left and right can be told apart.
double metal(const Vector3d& p, const ImplantOptions& size) {
  const double half_width = 0.5 * size.width_mm, radius_y = 0.5 * size.depth_mm, radius_z = 0.5 * size.height_mm - 2;
  const double inner_condyle = roller(p, 0.56 * half_width, 0.44 * half_width, radius_y, radius_z),
               outer_condyle = roller(p, -0.60 * half_width, 0.40 * half_width, 0.96 * radius_y, 0.97 * radius_z);
  const double lean = -0.12 * p.z();
  const double flange = std::max({std::abs(p.x() - lean) - 0.72 * half_width + 0.15 * std::abs(p.z()),
                                  -radius_y - p.y(), p.y() + 8, -12 - p.z(), p.z() - 0.62 * size.height_mm});
  const double front = -radius_y + size.thickness_mm, back = radius_y - size.thickness_mm,
               below = -radius_z + size.thickness_mm;
  // What is left of the bone: it lies between the cuts in front, behind, below, and two at 45 degrees.
  const double bone =
      std::max({front - p.y(), p.y() - back, below - p.z(), (front + below + 10 - p.y() - p.z()) / std::sqrt(2.0),
                (p.y() - p.z() - back + below + 10) / std::sqrt(2.0)});
  double field = cut(join(join(inner_condyle, outer_condyle, 1), flange, 3), -bone, 1);
  for (const double side : {-1.0, 1.0}) {
    const double peg = std::hypot(p.x() - side * 0.55 * half_width, p.y()) - 3.5;
    field = join(field, std::max({peg, below - 3 - p.z(), p.z() - below - 12}), 1);
  }
  return std::max(field, p.z() - 0.62 * size.height_mm);
}

Bone knee_implant(const ImplantOptions& options) {
  const ImplantOptions size = drawn(options);
  const Vector3d half(0.5 * size.width_mm + 8, 0.5 * size.depth_mm + 8, 0.65 * size.height_mm + 8);
  Bone bone;
  bone.outer =
      phantom::polygonise([&](const Vector3d& p) { return metal(p, size); }, -half, half, size.resolution_mm, 3);
  bone.outer.frame = "bone";
  bone.thigh_radius_mm = size.tissue_radius_mm;
  bone.fat_mm = size.fat_mm;
  phantom::check_bone(bone, "simulate.femoral_implant");
  return bone;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("simulate.femoral_implant", knee_implant)
      .summary(
          "Makes the femoral part of a knee replacement: two condyles, a flange and two pegs around five plane cuts; "
          "it "
          "is as dense as compact bone, and its middle is the isocentre")
      .out("bone", "the implant, as a solid bone")
      .option("width_mm", &ImplantOptions::width_mm, "from side to side", at_least(45), at_most(90))
      .option("depth_mm", &ImplantOptions::depth_mm, "front to back", at_least(45), at_most(85))
      .option("height_mm", &ImplantOptions::height_mm, "from the condyles to the top of the flange, about",
              at_least(40), at_most(80))
      .option("thickness_mm", &ImplantOptions::thickness_mm, "thickness of the shell below, in front and behind",
              at_least(4), at_most(14))
      .option("shape_seed", &ImplantOptions::shape_seed, "seed of the variation", at_least(0))
      .option("variation", &ImplantOptions::variation, "0: exactly these measures; 1: random measures around them",
              at_least(0), at_most(1))
      .option("resolution_mm", &ImplantOptions::resolution_mm,
              "edge length of the cubes in which the surface is made into triangles", at_least(0.3), at_most(4))
      .option("tissue_radius_mm", &ImplantOptions::tissue_radius_mm,
              "radius of the soft tissue around the isocentre; 0: none", at_least(0))
      .option("fat_mm", &ImplantOptions::fat_mm, "thickness of the layer of fat", at_least(0));
}
