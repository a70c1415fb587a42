// SPDX-License-Identifier: Apache-2.0
// Photographs of a plastic bone in its clamp on a platform, from each stop of a camera's arm.

#include "marrow/simulate/photograph.hpp"
#include "marrow/domain/random.hpp"
#include "marrow/toolbox/phantom/phantom.hpp"

namespace {

using namespace marrow;
using phantom::Fragment, phantom::Painted;

struct Options : phantom::Sensor {
  std::string fragment = "distal";
  double clamp_mm = 32;
  double platform_radius_mm = 105;
  double ambient = 0.4;
  double lamps = 1;
  double backdrop = 0.045;
};

phantom::Studio studio_of(const Options& options) {
  phantom::Studio studio;
  for (phantom::Lamp& lamp : studio.lamps) lamp.strength *= options.lamps;
  studio.ambient = options.ambient;
  studio.backdrop *= options.backdrop / studio.backdrop[1];
  return studio;
}

Painted bone_of(const Fragment& fragment, const RigidTransform& world_from_ct) {
  Painted bone{fragment.outer, {0.86, 0.80, 0.66}, 0.12, true};
  bone.surface.frame = "world";
  for (Eigen::Vector3d& vertex : bone.surface.vertices_mm) vertex = world_from_ct * vertex;
  return bone;
}

/// A block around the bone's end, and the bolt through it.
std::vector<Painted> clamp_of(const Painted& bone, const RigidTransform& world_from_platform, double height_mm) {
  constexpr double kWall_mm = 5, kBolt_mm = 5, kBoltLength_mm = 14;
  const RigidTransform platform_from_world = inverse(world_from_platform);
  Eigen::Vector3d low(1e9, 1e9, 0), high(-1e9, -1e9, height_mm);
  for (const auto& triangle : bone.surface.triangles) {
    const Eigen::Vector3d p = platform_from_world * bone.surface.vertices_mm[triangle[0]];
    if (p.z() > height_mm) continue;
    low.head<2>() = low.head<2>().cwiseMin(p.head<2>() - Eigen::Vector2d::Constant(kWall_mm));
    high.head<2>() = high.head<2>().cwiseMax(p.head<2>() + Eigen::Vector2d::Constant(kWall_mm));
  }
  if (low.x() > high.x()) return {};
  RigidTransform bolt{"platform", "bolt", rotation_from_vector({0, kPi / 2, 0}), 0.5 * (low + high)};
  const double half = 0.5 * (high.x() - low.x());
  return {{phantom::box(world_from_platform, low, high), {0.10, 0.13, 0.30}, 0.3, false},
          {phantom::drum(world_from_platform * bolt, kBolt_mm, -half - kBoltLength_mm, half + kBoltLength_mm),
           {0.5, 0.5, 0.5},
           0.5,
           true}};
}

List<Picture> photograph(const phantom::CameraArm& arm, const phantom::Phantom& phantom, const Truth& fragment,
                         const Truth& platform, const Options& options, Context& context) {
  check_rigid(fragment.world_from_model, "the fragment's pose");
  check_rigid(platform.world_from_model, "the platform's pose");
  std::vector<Painted> bodies{
      bone_of(phantom::fragment_named(phantom, options.fragment, "simulate.photograph"), fragment.world_from_model)};
  for (Painted& part : clamp_of(bodies[0], platform.world_from_model, options.clamp_mm)) bodies.push_back(part);
  constexpr double kThickness_mm = 12;
  bodies.push_back({phantom::drum(platform.world_from_model, options.platform_radius_mm, -kThickness_mm, 0),
                    {0.42, 0.43, 0.44},
                    0.4,
                    false});
  const phantom::Studio studio = studio_of(options);
  List<Picture> pictures;
  for (std::size_t i = 0; i < arm.names.size(); ++i) {
    context.check_cancelled();
    pictures.add(arm.names[i],
                 phantom::photograph(bodies, phantom::camera_at_stop(arm, i, context.seed()), arm.device.distortion,
                                     studio, options, marrow::Random(context.seed(), 1000 + i)()));
  }
  return pictures;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  auto node = plugin.node("simulate.photograph", photograph);
  node.summary(
          "Colour photographs of a plastic bone in a clamp on a platform: light and shadow, highlights, distortion, "
          "blur, gamma and noise")
      .random()
      .in("arm", "the camera and where its arm stops")
      .in("phantom", "the bone and its fragments")
      .in("fragment", "exact pose of the fragment")
      .in("platform", "exact pose of the platform, with z upwards")
      .out("photographs", "one photograph from each stop of the arm, 8 bit colour", over("view"))
      .option("fragment", &Options::fragment, "name of the fragment that is photographed")
      .option("clamp_mm", &Options::clamp_mm, "height of the clamp on the platform; it hides the bone's end",
              at_least(0))
      .option("platform_radius_mm", &Options::platform_radius_mm, "radius of the platform's plate", at_least(1))
      .option("ambient", &Options::ambient, "even light from all sides; white paint under light of 1 is white",
              at_least(0), at_most(1), unit(""))
      .option("lamps", &Options::lamps, "strength of the lamps: 1 for 0.4 from the left and 0.2 from the right",
              at_least(0), at_most(2), unit(""))
      .option("backdrop", &Options::backdrop, "light from the backdrop", at_least(0), at_most(1), unit(""));
  phantom::declare_sensor<Options>(node);
}
