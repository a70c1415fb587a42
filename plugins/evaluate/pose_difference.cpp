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
  const marrow::FragmentFrame frame = marrow::fragment_frame(model);
  const marrow::Vector6d motion = marrow::motion_between(other, found, frame);
  const Eigen::Vector3d apart_mm = found * frame.origin_mm - other * frame.origin_mm;
  return {{{"rotation_deg", marrow::degrees(marrow::geodesic_angle_rad(found.rotation, other.rotation)), "deg"},
           {"frontal_deg", marrow::degrees(motion[0]), "deg"},
           {"lateral_deg", marrow::degrees(motion[1]), "deg"},
           {"axial_deg", marrow::degrees(motion[2]), "deg"},
           {"translation_mm", motion.tail<3>().norm(), "mm"},
           {"x_mm", apart_mm.x(), "mm"},
           {"y_mm", apart_mm.y(), "mm"},
           {"z_mm", apart_mm.z(), "mm"},
           {"distance_mm", geometry::mean(geometry::target_errors_mm(found, other, targets_mm)), "mm"}}};
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("evaluate.pose_difference", pose_difference)
      .summary(
          "Difference between two poses of one fragment if no truth is known, for example poses of two methods, or a "
          "result and a placement by hand")
      .in("pose", "pose found")
      .in("reference", "pose to compare with")
      .in("model", "surface of the fragment; it gives the axes, the centroid and the points")
      .out("metrics",
           "rotation angle (geodesic); signed rotations about the frontal, lateral and long axes; displacement of the "
           "centroid: its length, and its parts along x, y and z of the world; mean distance between the positions of "
           "the surface's points in both poses")
      .figures({"rotation_deg", "frontal_deg", "lateral_deg", "axial_deg", "translation_mm", "x_mm", "y_mm", "z_mm",
                "distance_mm"})
      .option("points", &Options::points, "number of points spread over the surface", marrow::at_least(1),
              marrow::at_most(1e6));
}
