// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/robot/relative_pose.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "marrow/domain/decompositions.hpp"

namespace marrow::robot {
namespace {

/// The covariance of a pose's small motion about its own middle, as one about another point and along other axes.
/// `axes`: the pose's axes in them; `arm`: from the pose's middle to the point, in them.
Matrix6d about(const Matrix6d& covariance, const Eigen::Matrix3d& axes, const Eigen::Vector3d& arm) {
  Matrix6d change = Matrix6d::Zero();
  change.topLeftCorner<3, 3>() = change.bottomRightCorner<3, 3>() = axes;
  for (int i = 0; i < 3; ++i) change.block<3, 1>(3, i) = axes.col(i).cross(arm);
  return change * covariance * change.transpose();
}

double largest(const Eigen::Matrix3d& covariance) {
  return covariance.allFinite() ? std::sqrt(std::max(0.0, eigen_of_symmetric<3>(covariance).values[2]))
                                : std::numeric_limits<double>::infinity();
}

}  // namespace

RelativePose relative_pose(const Pose& fragment, const Pose& reference) {
  check_rigid(fragment.world_from_model, "the pose of the fragment");
  check_rigid(reference.world_from_model, "the pose of the reference");
  RelativePose relative;
  relative.reference_from_fragment = inverse(reference.world_from_model) * fragment.world_from_model;
  relative.reference_from_fragment.target = "reference";
  relative.reference_from_fragment.source = "fragment";
  relative.covariance.setConstant(std::numeric_limits<double>::quiet_NaN());
  if (!fragment.covariance || !reference.covariance) return relative;
  const Eigen::Vector3d middle = relative.reference_from_fragment * fragment.frame.origin_mm;
  relative.covariance = about(*fragment.covariance, relative.reference_from_fragment.rotation * fragment.frame.axes,
                              Eigen::Vector3d::Zero()) +
                        about(*reference.covariance, reference.frame.axes, middle - reference.frame.origin_mm);
  return relative;
}

double rotation_deviation_rad(const Matrix6d& covariance) { return largest(covariance.topLeftCorner<3, 3>()); }
double shift_deviation_mm(const Matrix6d& covariance) { return largest(covariance.bottomRightCorner<3, 3>()); }

}  // namespace marrow::robot
