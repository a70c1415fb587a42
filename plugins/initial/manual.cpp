// SPDX-License-Identifier: Apache-2.0
// A start given by hand: the nominal placement, moved about and along the fragment's own axes.
#include <cmath>
#include <marrow/plugin.hpp>

#include "marrow/toolbox/geometry/targets.hpp"

namespace {

struct Options {
  std::array<double, 3> rotation_deg{0, 0, 0};
  std::array<double, 3> translation_mm{0, 0, 0};
  double distance_mm = 0;
  bool needs_start = false;
};

/// Scales a motion so that it moves the surface by `distance_mm` on average. It uses bisection, because the distance
/// grows with the motion up to half a turn.
marrow::Vector6d scaled(const marrow::Vector6d& motion, const marrow::Pose& pose, const marrow::Mesh& model,
                        double distance_mm) {
  const std::vector<Eigen::Vector3d> points_mm = marrow::sample_surface(model, 500);
  const auto distance_at = [&](double scale) {
    return marrow::geometry::mean(marrow::geometry::target_errors_mm(
        marrow::moved(pose.world_from_model, pose.frame, scale * motion), pose.world_from_model, points_mm));
  };
  double low = 0, high = motion.head<3>().norm() > 0 ? marrow::kPi / motion.head<3>().norm()
                                                     : 2 * distance_mm / motion.tail<3>().norm();
  if (!std::isfinite(high) || distance_at(high) < distance_mm)
    throw marrow::Error(
        "distance_mm: no multiple of rotation_deg and translation_mm moves the surface that far; give a rotation or "
        "translation, or a shorter distance");
  for (int i = 0; i < 60; ++i) (distance_at(0.5 * (low + high)) < distance_mm ? low : high) = 0.5 * (low + high);
  return high * motion;
}

marrow::Pose manual(const marrow::Mesh& model, const marrow::Pose* start, const Options& options,
                    const marrow::Context& context) {
  marrow::check_mesh(model, "model");
  if (!start && options.needs_start)
    throw marrow::Error(
        "there is no start; give the approximate placement of the fragment, in case.yaml under 'start' (docs/case.md)");
  marrow::Pose pose;
  if (start) {
    pose.world_from_model = start->world_from_model;
  } else {
    pose.world_from_model.source = model.frame;
    context.warn(
        "there is no start, so CT coordinates are taken as world coordinates; if the bone is elsewhere in the images, "
        "give its approximate placement, in case.yaml under 'start' (docs/case.md)");
  }
  marrow::check_pose(pose, "start");
  pose.frame = marrow::fragment_frame(model);
  marrow::Vector6d motion;
  for (int i = 0; i < 3; ++i) {
    motion(i) = marrow::radians(options.rotation_deg[i]);
    motion(3 + i) = options.translation_mm[i];
  }
  if (options.distance_mm > 0) motion = scaled(motion, pose, model, options.distance_mm);
  pose.world_from_model = marrow::moved(pose.world_from_model, pose.frame, motion);
  return pose;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("initial.manual", manual)
      .summary("The nominal placement, moved by a given rotation about and translation along the fragment's axes")
      .in("model", "surface of the fragment")
      .in("start", "nominal placement; none: CT coordinates are taken as world coordinates")
      .out("pose", "the moved placement")
      .option("rotation_deg", &Options::rotation_deg, "rotation vector about the frontal, lateral and long axis")
      .option("translation_mm", &Options::translation_mm, "shift along the frontal, lateral and long axis")
      .option("distance_mm", &Options::distance_mm,
              "if above 0, both are scaled until the mean distance moved by the surface is this", marrow::at_least(0))
      .option("needs_start", &Options::needs_start, "fail if there is no start, for pipelines with other ways to one");
}
