// SPDX-License-Identifier: Apache-2.0
// A start from fiducial markers, or from landmarks touched by a pointer, that a tracking system measures in the world.
// Least squares over paired points (Arun, Huang and Blostein 1987). Horn's quaternions (J Opt Soc Am A 1987) give the
// same optimum.
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <marrow/plugin.hpp>

#include "marrow/toolbox/geometry/rigid_fit.hpp"

namespace {

using namespace marrow;

struct Options {
  double noise_mm = 0;
  double warn_above_mm = 2;
};

/// Points of the CT and their tracked positions, in the same order.
struct Pairs {
  std::vector<std::string> names;
  std::vector<Eigen::Vector3d> model_mm, world_mm;
};

Pairs pairs_of(const Landmarks& landmarks) {
  Pairs pairs;
  for (const Landmarks::Tracked& tracked : landmarks.tracked) {
    const auto point = std::find_if(landmarks.points.begin(), landmarks.points.end(),
                                    [&](const auto& one) { return one.name == tracked.name; });
    if (point == landmarks.points.end())
      throw Error("'" + tracked.name +
                  "' was tracked, but the landmarks have no point of that name in the CT; give its place there, or "
                  "leave it out");
    pairs.names.push_back(tracked.name);
    pairs.model_mm.push_back(point->model_mm);
    pairs.world_mm.push_back(tracked.world_mm);
  }
  return pairs;
}

/// Distances that remain after the fit: sum of squares, largest distance, and the point that has it.
struct Residuals {
  double squares = 0, largest = 0;
  std::string farthest;
};

Residuals residuals_of(const Pairs& pairs, const RigidTransform& world_from_model) {
  Residuals residuals;
  for (std::size_t i = 0; i < pairs.names.size(); ++i) {
    const double distance = (world_from_model * pairs.model_mm[i] - pairs.world_mm[i]).norm();
    residuals.squares += distance * distance;
    if (distance < residuals.largest) continue;
    residuals.largest = distance;
    residuals.farthest = pairs.names[i];
  }
  return residuals;
}

/// Covariance of the small motion if each coordinate of a pair has the standard deviation `deviation_mm`. At any target
/// it gives the expected error of Fitzpatrick, West and Maurer (IEEE TMI 17, 1998).
Matrix6d covariance_of(const Pairs& pairs, const FragmentFrame& frame, double deviation_mm) {
  Matrix6d information = Matrix6d::Zero();
  for (const Eigen::Vector3d& point : pairs.model_mm) {
    const auto derivatives = geometry::point_by_motion(frame, point);
    information += derivatives.transpose() * derivatives;
  }
  return deviation_mm * deviation_mm * information.inverse();
}

Pose fiducials(const Mesh& model, const Landmarks& landmarks, const Options& options, Context& context) {
  check_mesh(model, "model");
  const Pairs pairs = pairs_of(landmarks);
  const double count = double(pairs.names.size());
  Pose pose;
  pose.world_from_model = geometry::fit_rigid(pairs.model_mm, pairs.world_mm, "the tracked points");
  pose.world_from_model.source = model.frame;
  pose.frame = fragment_frame(model);
  const Residuals residuals = residuals_of(pairs, pose.world_from_model);
  pose.cost = std::sqrt(residuals.squares / count);
  const double deviation_mm = options.noise_mm > 0 ? options.noise_mm : std::sqrt(residuals.squares / (3 * count - 6));
  pose.covariance = covariance_of(pairs, pose.frame, deviation_mm);
  context.info(
      formatted("fiducial registration error {} mm over {} points, localisation error {} mm; predicted error of the "
                "fragment's centroid {} mm",
                short_number(pose.cost), pairs.names.size(), short_number(std::sqrt(3.0) * deviation_mm),
                short_number(std::sqrt(pose.covariance->bottomRightCorner<3, 3>().trace()))));
  if (pose.cost > options.warn_above_mm) {
    pose.warnings.push_back(
        formatted("the tracked points do not fit those in the CT: they are off by {:.3g} mm, '{}' by {:.3g} mm; are "
                  "two names exchanged, or did a marker move?",
                  pose.cost, residuals.farthest, residuals.largest));
    context.warn(pose.warnings.back());
  }
  return pose;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("initial.fiducials", fiducials)
      .summary(
          "Rigid fit of the landmarks in the CT to their tracked positions (Arun, Huang and Blostein 1987), with the "
          "predicted error")
      .in("model", "surface of the fragment; it gives the axes")
      .in("landmarks", "points in the CT and their tracked positions")
      .out("pose",
           "fitted pose; its cost is the fiducial registration error (FRE) in mm, its covariance follows from the "
           "localisation error")
      .option("noise_mm", &Options::noise_mm,
              "standard deviation of each coordinate of a pair; 0: estimated from the residuals", at_least(0))
      .option("warn_above_mm", &Options::warn_above_mm, "a larger fiducial registration error gives a warning",
              at_least(0));
}
