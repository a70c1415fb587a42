// SPDX-License-Identifier: Apache-2.0
#include <marrow/plugin.hpp>

#include "marrow/toolbox/geometry/fragments.hpp"

namespace {

using marrow::geometry::FragmentPair;

struct Reduction {
  marrow::Pose pose;
  marrow::Metrics metrics;
};

Reduction reduction(const marrow::List<marrow::Pose>& poses, const marrow::List<marrow::Mesh>* models,
                    const FragmentPair& options) {
  const auto [moved, reference] = marrow::geometry::poses_of_pair(poses, options, models);
  Reduction result;
  result.pose = moved;
  result.pose.world_from_model = reference.world_from_model;
  result.pose.covariance.reset();
  result.pose.convergence.clear();
  // In world coordinates: the shift of the fragment's centroid, and the rotation vector about this centroid.
  const Eigen::AngleAxisd turn(
      Eigen::Matrix3d(reference.world_from_model.rotation * moved.world_from_model.rotation.transpose()));
  const Eigen::Vector3d turn_deg = marrow::degrees(turn.angle()) * turn.axis();
  const Eigen::Vector3d shift_mm =
      reference.world_from_model * moved.frame.origin_mm - moved.world_from_model * moved.frame.origin_mm;
  result.metrics.items = {{"turn_x_deg", turn_deg.x(), "deg"}, {"turn_y_deg", turn_deg.y(), "deg"},
                          {"turn_z_deg", turn_deg.z(), "deg"}, {"turn_deg", turn_deg.norm(), "deg"},
                          {"shift_x_mm", shift_mm.x(), "mm"},  {"shift_y_mm", shift_mm.y(), "mm"},
                          {"shift_z_mm", shift_mm.z(), "mm"},  {"shift_mm", shift_mm.norm(), "mm"}};
  return result;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("fracture.reduction", reduction)
      .summary("The pose of a fragment that restores the bone as the CT shows it, and the motion to this pose")
      .in("poses", "poses of both fragments", marrow::over("fragment"))
      .in("models", "surfaces of both fragments; they give the centroid if a pose does not", marrow::over("fragment"))
      .out("pose", &Reduction::pose, "pose of the moved fragment in the restored bone")
      .out("metrics", &Reduction::metrics,
           "in world coordinates: the rotation vector about the fragment's centroid, and the shift of the centroid, "
           "with their lengths")
      .figures(
          {"turn_x_deg", "turn_y_deg", "turn_z_deg", "turn_deg", "shift_x_mm", "shift_y_mm", "shift_z_mm", "shift_mm"})
      .option("moved", &FragmentPair::moved, "fragment that is moved")
      .option("reference", &FragmentPair::reference, "fragment that stays");
}
