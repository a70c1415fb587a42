// SPDX-License-Identifier: Apache-2.0
// Errors of a pose against the truth. Every table of marrow uses these figures. They describe the small motion from the
// true pose to the found one, about the fragment's centroid and along its own axes.
#include <algorithm>
#include <cmath>
#include <marrow/plugin.hpp>

#include <marrow/domain/decompositions.hpp>
#include "marrow/toolbox/geometry/targets.hpp"

namespace {

using marrow::degrees;

struct Options {
  int points = 500;
};

/// Standard deviation in the worst direction.
double largest_deviation(const Eigen::Matrix3d& covariance) {
  return std::sqrt(std::max(0.0, marrow::eigen_of_symmetric(covariance).values[2]));
}

void add_predictions(const marrow::Pose& pose, const marrow::FragmentFrame& frame, marrow::Metrics& metrics) {
  // If the images do not determine a direction at all, its deviation is infinite. Then no prediction is given.
  if (!pose.covariance || !pose.covariance->allFinite()) return;
  const marrow::Matrix6d covariance = *marrow::in_frame(pose, frame).covariance;
  const auto deviation = [&](int i) { return std::sqrt(std::max(0.0, covariance(i, i))); };
  metrics.items.push_back({"predicted_frontal_deg", degrees(deviation(0)), "deg"});
  metrics.items.push_back({"predicted_lateral_deg", degrees(deviation(1)), "deg"});
  metrics.items.push_back({"predicted_axial_deg", degrees(deviation(2)), "deg"});
  metrics.items.push_back({"predicted_max_deg", degrees(largest_deviation(covariance.topLeftCorner<3, 3>())), "deg"});
  metrics.items.push_back({"predicted_along_mm", deviation(5), "mm"});
  metrics.items.push_back({"predicted_along_frontal_mm", deviation(3), "mm"});
  metrics.items.push_back({"predicted_along_lateral_mm", deviation(4), "mm"});
  metrics.items.push_back({"predicted_max_mm", largest_deviation(covariance.bottomRightCorner<3, 3>()), "mm"});
}

marrow::Metrics pose_error(const marrow::Pose& pose, const marrow::Truth& truth, const marrow::Mesh& model,
                           const Options& options) {
  const marrow::RigidTransform &found = pose.world_from_model, &exact = truth.world_from_model;
  marrow::geometry::check_poses(found, exact);
  marrow::check_pose(pose, "pose");
  marrow::geometry::check_model(found, model);
  const marrow::FragmentFrame frame = marrow::fragment_frame(model);
  const marrow::Vector6d motion = marrow::motion_between(exact, found, frame);
  const Eigen::Vector3d turn_rad = motion.head<3>(), shift_mm = motion.tail<3>();

  marrow::Metrics metrics;
  metrics.items = {
      {"rotation_deg", degrees(marrow::geodesic_angle_rad(found.rotation, exact.rotation)), "deg"},
      {"frontal_deg", degrees(turn_rad[0]), "deg"},
      {"lateral_deg", degrees(turn_rad[1]), "deg"},
      {"axial_deg", degrees(turn_rad[2]), "deg"},
      {"translation_mm", shift_mm.norm(), "mm"},
      {"along_mm", shift_mm[2], "mm"},
      {"along_frontal_mm", shift_mm[0], "mm"},
      {"along_lateral_mm", shift_mm[1], "mm"},
      {"across_mm", std::hypot(shift_mm[0], shift_mm[1]), "mm"},
      {"mtre_mm",
       marrow::geometry::mean(marrow::geometry::target_errors_mm(
           found, exact, marrow::sample_surface(model, std::size_t(options.points)))),
       "mm"},
      {"chapter_rotation_deg", degrees(turn_rad.cwiseAbs().mean()), "deg"},
      {"chapter_translation_mm", shift_mm.cwiseAbs().mean(), "mm"},
  };
  add_predictions(pose, frame, metrics);
  return metrics;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("evaluate.pose_error", pose_error)
      .summary(
          "Rotation error, translation error and target registration error of a pose, with the predicted standard "
          "deviations")
      .in("pose", "pose found")
      .in("truth", "exact pose")
      .in("model", "surface of the fragment; it gives the axes, the centroid and the targets")
      .out("metrics",
           "rotation angle (geodesic); signed angles about the frontal, lateral and long axes; displacement of the "
           "centroid: its length, its signed parts along the long, frontal and lateral axes, and its length across the "
           "long axis; mTRE; means of the three absolute angles and of the three absolute translations; predicted "
           "standard deviations if the pose has a covariance")
      .figures({"rotation_deg",
                "frontal_deg",
                "lateral_deg",
                "axial_deg",
                "translation_mm",
                "along_mm",
                "along_frontal_mm",
                "along_lateral_mm",
                "across_mm",
                "mtre_mm",
                "chapter_rotation_deg",
                "chapter_translation_mm",
                "predicted_frontal_deg",
                "predicted_lateral_deg",
                "predicted_axial_deg",
                "predicted_max_deg",
                "predicted_along_mm",
                "predicted_along_frontal_mm",
                "predicted_along_lateral_mm",
                "predicted_max_mm"})
      .option("points", &Options::points, "number of targets spread over the surface for the mTRE", marrow::at_least(1),
              marrow::at_most(1e6));
}
