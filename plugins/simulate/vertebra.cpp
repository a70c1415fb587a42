// SPDX-License-Identifier: Apache-2.0
// A lumbar vertebra made from measures in the literature: a bone without a shaft.
#include <algorithm>
#include <marrow/plugin.hpp>

#include "marrow/domain/random.hpp"
#include "marrow/simulate/polygonise.hpp"
#include "marrow/simulate/vertebra_shape.hpp"
#include "marrow/toolbox/phantom/phantom.hpp"

namespace {

using namespace marrow;
using phantom::Bone;

struct VertebraOptions {
  int shape_seed = 1;
  double variation = 0;
  double ripple_mm = 0.3;
  double cancellous_fraction = 0.15;
  double resolution_mm = 0.8;
  double tissue_radius_mm = 110;
  double fat_mm = 20;
  double body_width_mm = 45;
  double body_depth_mm = 34;
  double body_height_mm = 27;
  double transverse_width_mm = 86;
  double length_mm = 87;
  double shell_mm = 1;
};

/// Draws each measure from a normal distribution with the variation between people, cut at 2 standard deviations.
phantom::VertebraShape drawn(const VertebraOptions& options) {
  Random random(std::uint64_t(options.shape_seed), 2);
  const auto draw = [&](double mean, double part) {
    return mean * (1 + options.variation * part * std::clamp(random.normal(), -2.0, 2.0));
  };
  phantom::VertebraShape shape;
  const double size = draw(1, 0.05);
  shape.body_width_mm = size * draw(options.body_width_mm, 0.04);
  shape.body_depth_mm = size * draw(options.body_depth_mm, 0.04);
  shape.body_height_mm = size * draw(options.body_height_mm, 0.05);
  shape.canal_width_mm = draw(shape.canal_width_mm, 0.06);
  shape.canal_depth_mm = draw(shape.canal_depth_mm, 0.06);
  shape.pedicle_width_mm = size * draw(shape.pedicle_width_mm, 0.12);
  shape.pedicle_height_mm = size * draw(shape.pedicle_height_mm, 0.06);
  shape.transverse_width_mm = size * draw(options.transverse_width_mm, 0.06);
  shape.length_mm = size * draw(options.length_mm, 0.03);
  shape.waist_mm = draw(shape.waist_mm, 0.2);
  shape.dish_mm = draw(shape.dish_mm, 0.2);
  shape.shell_mm = options.shell_mm;
  shape.ripple_mm = options.ripple_mm;
  shape.seed = std::uint64_t(options.shape_seed);
  return shape;
}

Bone vertebra(const VertebraOptions& options, Context& context) {
  const phantom::VertebraField field(drawn(options));
  constexpr double kSteepest = 2;
  Bone bone;
  context.progress(0, "outer surface");
  bone.outer = phantom::polygonise([&](const Eigen::Vector3d& p) { return field.outer(p); }, field.low_mm(),
                                   field.high_mm(), options.resolution_mm, kSteepest);
  context.check_cancelled();
  context.progress(0.5, "inner surface");
  bone.inner = phantom::polygonise([&](const Eigen::Vector3d& p) { return field.inner(p); }, field.low_mm(),
                                   field.high_mm(), options.resolution_mm, kSteepest);
  bone.outer.frame = bone.inner.frame = "bone";
  bone.fill_fraction = {options.cancellous_fraction};
  bone.thigh_radius_mm = options.tissue_radius_mm;
  bone.fat_mm = options.fat_mm;
  phantom::check_bone(bone, "simulate.vertebra");
  return bone;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("simulate.vertebra", vertebra)
      .summary(
          "Makes a lumbar vertebra from published measures, with body, end plates, canal, pedicles, laminae and "
          "processes; the middle of its body is the isocentre (Panjabi et al., Spine 1992)")
      .out("bone", "bone with a closed outer and a closed inner surface")
      .option("body_width_mm", &VertebraOptions::body_width_mm, "width of the vertebral body at its end plates",
              at_least(30), at_most(65))
      .option("body_depth_mm", &VertebraOptions::body_depth_mm, "depth of the vertebral body, front to back",
              at_least(22), at_most(50))
      .option("body_height_mm", &VertebraOptions::body_height_mm, "height of the vertebral body", at_least(18),
              at_most(40))
      .option("transverse_width_mm", &VertebraOptions::transverse_width_mm,
              "distance between the tips of the transverse processes", at_least(60), at_most(120))
      .option("length_mm", &VertebraOptions::length_mm, "from the front of the body to the tip of the spinous process",
              at_least(70), at_most(120))
      .option("shell_mm", &VertebraOptions::shell_mm, "thickness of the cortical bone", at_least(0.3), at_most(2))
      .option("cancellous_fraction", &VertebraOptions::cancellous_fraction,
              "share of bone inside the cortical bone; the rest is marrow", at_least(0), at_most(1), unit(""))
      .option("shape_seed", &VertebraOptions::shape_seed, "seed of the variation and of the irregularities",
              at_least(0))
      .option("variation", &VertebraOptions::variation,
              "0: exactly these measures; 1: random measures around them, with the variation between people",
              at_least(0), at_most(1))
      .option("ripple_mm", &VertebraOptions::ripple_mm, "amplitude of smooth irregularities of the surface",
              at_least(0), at_most(1))
      .option("resolution_mm", &VertebraOptions::resolution_mm,
              "edge length of the cubes in which the surface is made into triangles", at_least(0.3), at_most(4))
      .option("tissue_radius_mm", &VertebraOptions::tissue_radius_mm,
              "radius of the soft tissue around the isocentre; 0: none", at_least(0))
      .option("fat_mm", &VertebraOptions::fat_mm, "thickness of the layer of fat", at_least(0));
}
