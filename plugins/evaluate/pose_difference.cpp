// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <marrow/plugin.hpp>

#include "marrow/toolbox/geometry/targets.hpp"

namespace {

struct Options {
  int points = 500;
};

marrow::Metrics pose_difference(const marrow::Pose& pose, const marrow::Pose& reference, const marrow::Mesh& model,
                                const Options& options) {
  namespace geometry = marrow::geometry;
  const marrow::RigidTransform &found = pose.world_from_model, &other = reference.world_from_model;
  geometry::check_poses(found, other, "reference");
  const std::vector<Eigen::Vector3d> targets_mm = geometry::targets_mm(found, &model, nullptr, options.points);
  const marrow::Vector6d motion = marrow::motion_between(other, found, marrow::fragment_frame(model));
  return {{{"rotation_deg", marrow::degrees(marrow::geodesic_angle_rad(found.rotation, other.rotation)), "deg"},
           {"axial_deg", marrow::degrees(motion[2]), "deg"},
           {"translation_mm", motion.tail<3>().norm(), "mm"},
           {"distance_mm", geometry::mean(geometry::target_errors_mm(found, other, targets_mm)), "mm"}}};
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("evaluate.pose_difference", pose_difference)
      .summary(
          "How far two poses of one fragment are apart, where no truth is known: of two methods, or of a result and a "
          "placement by hand")
      .in("pose", "pose found")
      .in("reference", "the other pose")
      .in("model", "the fragment's surface: gives its axes, its centroid and the points")
      .out("metrics",
           "geodesic angle; signed rotation about the long axis; displacement of the centroid; mean distance between "
           "the surface's points in both")
      .option("points", &Options::points, "points spread over the surface", marrow::at_least(1), marrow::at_most(1e6));
}
