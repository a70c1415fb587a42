// SPDX-License-Identifier: Apache-2.0
// A lumbar vertebra made from measures in the literature: a bone without a shaft.
#include <marrow/plugin.hpp>

#include "marrow/simulate/polygonise.hpp"
#include "marrow/toolbox/phantom/phantom.hpp"

namespace {

using namespace marrow;
using namespace marrow::phantom;

/// Parameters of a lumbar vertebra. Defaults are near the means of L3 (Panjabi et al., Spine 1992).
struct VertebraShape {
  double body_width_mm = 45;
  double body_depth_mm = 34;
  double body_height_mm = 27;
  double canal_width_mm = 24;
  double canal_depth_mm = 17.5;
  double pedicle_width_mm = 10;
  double pedicle_height_mm = 14.5;
  double transverse_width_mm = 86;  ///< between the tips of the transverse processes
  double length_mm = 87;            ///< from the front of the body to the tip of the spinous process
  double waist_mm = 2.5;            ///< by which the body's wall is narrower in the middle of its height
  double dish_mm = 1.5;             ///< depth of the end plates
  double shell_mm = 1;              ///< thickness of the cortical bone
  double ripple_mm = 0;             ///< amplitude of smooth irregularities of the surface
  std::uint64_t seed = 1;
};

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

/// A vertebra as two continuous fields, negative inside. Near the surface they are about the distance in mm. Points are
/// in frame "bone", with the middle of the vertebral body at the origin. Safe to use from several threads.
class VertebraField {
 public:
  explicit VertebraField(const VertebraShape& shape)
      : shape_(shape), scale_(shape.body_width_mm / 45), ripple_(shape.ripple_mm, 15, 30, Random(shape.seed, 8)) {}

  double outer(const Vector3d& p) const { return ripple_.added_to(cut(join(body(p), arch(p), 3), -canal(p), 1), p); }
  /// The endosteal surface: shell_mm inside the outer surface.
  double inner(const Eigen::Vector3d& point_mm) const { return outer(point_mm) + shape_.shell_mm; }

  /// Corners of a box that contains the vertebra.
  Vector3d low_mm() const {
    return Vector3d(-0.5 * shape_.transverse_width_mm, -0.5 * shape_.body_depth_mm, -32 * scale_).array() - 8;
  }

  Vector3d high_mm() const {
    return Vector3d(0.5 * shape_.transverse_width_mm, shape_.length_mm - 0.5 * shape_.body_depth_mm, 28 * scale_)
               .array() +
           8;
  }

 private:
  double body(const Vector3d& p) const {
    const double at = 2 * p.z() / shape_.body_height_mm;  // -1 at the lower end plate, 1 at the upper one
    constexpr double kRim = 0.8;                          // what the rounding of the rims takes away
    const double in = (shape_.waist_mm + kRim) * std::max(0.0, 1 - at * at) - kRim;
    const double half_width = 0.5 * shape_.body_width_mm - in, half_depth = 0.5 * shape_.body_depth_mm - in;
    const double relative = std::hypot(p.x() / half_width, p.y() / half_depth);
    const double dish = shape_.dish_mm * std::max(0.0, 1 - 1.4 * relative * relative);
    const double plates = std::abs(p.z()) - 0.5 * shape_.body_height_mm + dish;
    return cut(elliptic_wall(p.x(), p.y(), half_width, half_depth), plates, 3);
  }

  /// Pedicles, laminae and the seven processes. The vertebra is symmetric, so only the left half is described.
  double arch(const Vector3d& point) const {
    const double s = scale_, back = 0.5 * shape_.body_depth_mm, behind = back + shape_.canal_depth_mm;
    const Vector3d p(std::abs(point.x()), point.y(), point.z());
    const double pedicle_radius = 0.5 * shape_.pedicle_width_mm,
                 pedicle_x = 0.5 * shape_.canal_width_mm + pedicle_radius,
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
    const double superior =
        ellipsoid(p - Vector3d(pedicle_x + 1 * s, middle_y + 7 * s, 15 * s), Vector3d(6, 6, 11) * s);
    const double inferior = ellipsoid(p - Vector3d(12 * s, behind + 2 * s, -19 * s), Vector3d(6, 5.5, 11) * s);
    const double sides = join(join(pedicle, transverse, 4 * s), superior, 4 * s);
    return join(sides, join(join(lamina, spine, 4 * s), inferior, 3 * s), 3 * s);
  }

  double canal(const Vector3d& p) const {
    const double half_depth = 0.5 * shape_.canal_depth_mm;
    return elliptic_wall(p.x(), p.y() - 0.5 * shape_.body_depth_mm - half_depth, 0.5 * shape_.canal_width_mm,
                         half_depth);
  }

  VertebraShape shape_;
  double scale_;  ///< of the parts without a measure of their own, from the body's width
  Ripple ripple_;
};

struct VertebraOptions : VertebraShape {
  VertebraOptions() { ripple_mm = 0.3; }
  int shape_seed = 1;
  double variation = 0;
  double cancellous_fraction = 0.15;
  double resolution_mm = 0.8;
  double tissue_radius_mm = 110;
  double fat_mm = 20;
};

/// Draws each measure from a normal distribution with the variation between people, cut at 2 standard deviations.
VertebraShape drawn(const VertebraOptions& options) {
  Random random(std::uint64_t(options.shape_seed), 2);
  const auto draw = [&](double mean, double part) {
    return mean * (1 + options.variation * part * std::clamp(random.normal(), -2.0, 2.0));
  };
  VertebraShape shape = options;
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
  shape.seed = std::uint64_t(options.shape_seed);
  return shape;
}

Bone vertebra(const VertebraOptions& options, Context& context) {
  const VertebraField field(drawn(options));
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
