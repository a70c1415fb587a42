// SPDX-License-Identifier: Apache-2.0
// A pose from markers on the skin that a tracking system measures in the world. There are two kinds of error: that of
// each single marker, and a common motion of all markers, because the skin slides about and along the bone. The pose is
// fitted by weighted least squares with the covariance of both, from the unweighted fit (Arun, Huang and Blostein, IEEE
// PAMI 9, 1987; Umeyama, IEEE PAMI 13, 1991).
#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <marrow/plugin.hpp>
#include <set>

#include "marrow/toolbox/geometry/rigid_fit.hpp"

namespace {

using namespace marrow;

struct Options {
  std::vector<double> noise_mm{2};
  double common_rotation_deg = 5;
  double common_shift_mm = 5;
};

/// Markers in the CT and as tracked, in the order of tracking, with their standard deviations.
struct Markers {
  std::vector<std::string> names;
  std::vector<Eigen::Vector3d> model_mm, world_mm;
  std::vector<double> noise_mm;
};

void check_names(const Landmarks& landmarks) {
  std::set<std::string> names;
  for (const Landmarks::Tracked& tracked : landmarks.tracked)
    if (!names.insert(tracked.name).second)
      throw Error("the marker '" + tracked.name + "' was tracked twice; each marker needs a name of its own");
}

Markers markers_of(const Landmarks& landmarks, const Options& options) {
  check_names(landmarks);
  const std::size_t count = landmarks.tracked.size();
  if (options.noise_mm.size() != 1 && options.noise_mm.size() != count)
    throw Error(formatted("noise_mm has {} numbers for {} tracked markers; give one for all, or one for each",
                          options.noise_mm.size(), count));
  for (const double noise : options.noise_mm)
    if (!(noise > 0 && std::isfinite(noise)))
      throw Error("noise_mm: each number must be positive, got " + short_number(noise));
  Markers markers;
  for (std::size_t i = 0; i < count; ++i) {
    const Landmarks::Tracked& tracked = landmarks.tracked[i];
    const auto point = std::find_if(landmarks.points.begin(), landmarks.points.end(),
                                    [&](const auto& one) { return one.name == tracked.name; });
    if (point == landmarks.points.end())
      throw Error("the marker '" + tracked.name +
                  "' was tracked, but it has no place in the CT; give its place there, or leave it out");
    if (!tracked.world_mm.allFinite() || !point->model_mm.allFinite())
      throw Error("the marker '" + tracked.name +
                  "' has a coordinate that is not a number; leave out a marker that the tracking system did not see");
    markers.names.push_back(tracked.name);
    markers.model_mm.push_back(point->model_mm);
    markers.world_mm.push_back(tracked.world_mm);
    markers.noise_mm.push_back(options.noise_mm[options.noise_mm.size() == 1 ? 0 : i]);
  }
  return markers;
}

/// The linear model y = J m + e about a pose: m is the small motion, and e has the covariance S = diag(sigma^2) + J C
/// J^T with C that of the markers' common motion.
struct Linear {
  Eigen::MatrixXd by_motion, covariance;
  Eigen::VectorXd residuals_mm;
};

Linear linear_at(const RigidTransform& pose, const FragmentFrame& frame, const Markers& markers,
                 const Matrix6d& common) {
  const auto count = Eigen::Index(markers.names.size());
  Linear linear{Eigen::MatrixXd(3 * count, 6), Eigen::MatrixXd::Zero(3 * count, 3 * count), Eigen::VectorXd(3 * count)};
  for (Eigen::Index i = 0; i < count; ++i) {
    const auto k = std::size_t(i);
    linear.by_motion.middleRows<3>(3 * i) = pose.rotation * geometry::point_by_motion(frame, markers.model_mm[k]);
    linear.residuals_mm.segment<3>(3 * i) = markers.world_mm[k] - pose * markers.model_mm[k];
    linear.covariance.diagonal().segment<3>(3 * i).setConstant(markers.noise_mm[k] * markers.noise_mm[k]);
  }
  linear.covariance += linear.by_motion * common * linear.by_motion.transpose();
  return linear;
}

/// Gauss-Newton. Returns the covariance of the small motion at the pose, (J^T S^-1 J)^-1.
Matrix6d fit_weighted(RigidTransform& pose, const FragmentFrame& frame, const Markers& markers,
                      const Matrix6d& common) {
  constexpr int kRounds = 20;
  constexpr double kEnd = 1e-12;  // radians and mm
  for (int round = 1;; ++round) {
    const Linear linear = linear_at(pose, frame, markers, common);
    const Eigen::LLT<Eigen::MatrixXd> covariance(linear.covariance);
    const Eigen::MatrixXd weighted = covariance.solve(linear.by_motion);
    const Matrix6d inverse = Matrix6d(linear.by_motion.transpose() * weighted).inverse();
    const Vector6d step = inverse * (weighted.transpose() * linear.residuals_mm);
    if (round == kRounds || step.norm() < kEnd) return 0.5 * (inverse + inverse.transpose());
    pose = moved(pose, frame, step);
  }
}

/// Compares the residuals, in units of the markers' own noise, with their expectation for 3 N - 6 degrees of freedom.
void warn_of_residuals(Pose& pose, const Markers& markers, Context& context) {
  constexpr double kMost = 2.5;  // three correct markers exceed it once in 3000 cases, more markers less often
  double squares = 0, largest = 0;
  std::string farthest;
  for (std::size_t i = 0; i < markers.names.size(); ++i) {
    const double off_mm = (pose.world_from_model * markers.model_mm[i] - markers.world_mm[i]).norm();
    squares += off_mm * off_mm / (markers.noise_mm[i] * markers.noise_mm[i]);
    pose.cost += off_mm * off_mm / double(markers.names.size());
    if (off_mm < largest) continue;
    largest = off_mm;
    farthest = markers.names[i];
  }
  pose.cost = std::sqrt(pose.cost);
  const double ratio = std::sqrt(squares / double(3 * markers.names.size() - 6));
  context.info(formatted(
      "markers off by {:.3g} mm after the fit, {:.3g} times what noise_mm says; axial rotation known to {:.3g} degrees",
      pose.cost, ratio, degrees(std::sqrt((*pose.covariance)(2, 2)))));
  if (ratio <= kMost) return;
  pose.warnings.push_back(
      formatted("the markers have moved relative to each other: they are off by {:.3g} times what noise_mm says, '{}' "
                "by {:.3g} mm; are two names exchanged, or did a marker move?",
                ratio, farthest, largest));
  context.warn(pose.warnings.back());
}

Pose skin_markers(const Mesh& model, const Landmarks& landmarks, const Options& options, Context& context) {
  check_mesh(model, "model");
  const Markers markers = markers_of(landmarks, options);
  Pose pose;
  pose.world_from_model = geometry::fit_rigid(markers.model_mm, markers.world_mm, "the markers");
  pose.world_from_model.source = model.frame;
  pose.frame = fragment_frame(model);
  const double common_rad = radians(options.common_rotation_deg), common_mm = options.common_shift_mm;
  Vector6d deviations;
  deviations << 0, 0, common_rad, common_mm, common_mm, common_mm;
  pose.covariance = fit_weighted(pose.world_from_model, pose.frame, markers, deviations.cwiseAbs2().asDiagonal());
  warn_of_residuals(pose, markers, context);
  return pose;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("initial.skin_markers", skin_markers)
      .summary(
          "Pose from tracked markers on the skin, by weighted least squares; its covariance includes the error of each "
          "marker and their common motion about the bone")
      .in("model", "surface of the fragment; it gives the axes")
      .in("landmarks", "markers in the CT and their tracked positions")
      .out("pose",
           "fitted pose with its covariance; its cost is the root mean square of the remaining distances, in mm")
      .option("noise_mm", &Options::noise_mm,
              "standard deviation of each tracked coordinate of a single marker: one for all, or one for each in the "
              "order of tracking")
      .option("common_rotation_deg", &Options::common_rotation_deg,
              "standard deviation of the rotation of all markers together about the long axis", at_least(0),
              at_most(90))
      .option("common_shift_mm", &Options::common_shift_mm,
              "standard deviation of the shift of all markers together, along each axis of the fragment", at_least(0));
}
