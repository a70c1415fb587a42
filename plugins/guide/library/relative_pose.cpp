// SPDX-License-Identifier: Apache-2.0
#include "marrow/guide/relative_pose.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "marrow/domain/decompositions.hpp"

namespace marrow::guide {
namespace {

double largest(const Eigen::Matrix3d& covariance) {
  return covariance.allFinite() ? std::sqrt(std::max(0.0, eigen_of_symmetric<3>(covariance).values[2]))
                                : std::numeric_limits<double>::infinity();
}

}  // namespace

RelativePose relative_pose(const Pose& fragment, const Pose& reference) {
  check_pose(fragment, "the pose of the fragment");
  check_pose(reference, "the pose of the reference");
  RelativePose relative;
  relative.reference_from_fragment = inverse(reference.world_from_model) * fragment.world_from_model;
  relative.reference_from_fragment.target = "reference";
  relative.reference_from_fragment.source = "fragment";
  relative.covariance.setConstant(std::numeric_limits<double>::quiet_NaN());
  if (!fragment.covariance || !reference.covariance) return relative;
  const RigidTransform& place = relative.reference_from_fragment;
  const FragmentFrame middle{place * fragment.frame.origin_mm, Eigen::Matrix3d::Identity()};
  const FragmentFrame own{middle.origin_mm, place.rotation * fragment.frame.axes};
  const Matrix6d of_fragment = change_of_frame(own, middle), of_reference = change_of_frame(reference.frame, middle);
  relative.covariance = of_fragment * *fragment.covariance * of_fragment.transpose() +
                        of_reference * *reference.covariance * of_reference.transpose();
  return relative;
}

double rotation_deviation_rad(const Matrix6d& covariance) { return largest(covariance.topLeftCorner<3, 3>()); }
double shift_deviation_mm(const Matrix6d& covariance) { return largest(covariance.bottomRightCorner<3, 3>()); }

}  // namespace marrow::guide
