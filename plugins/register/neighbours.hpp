// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <Eigen/Core>
#include <functional>
#include <vector>

#include "marrow/domain/pose.hpp"

namespace marrow::together {

/// The cost of the poses of all bones.
using JointCost = std::function<double(const std::vector<RigidTransform>&)>;

/// The poses after small motions about and along their frames' axes [rad, mm], six numbers for each bone.
std::vector<RigidTransform> moved(const std::vector<Pose>& poses, const Eigen::VectorXd& motions);

/// The covariance of all poses together is root * root^T; the columns are its principal axes in units of the single
/// bones' deviations. Each pose holds the covariance that it would have if all others were exact. The curvature of the
/// cost says how far a bone gives way if another one moves: with unit deviations, the information of all poses is 1 on
/// the diagonal and the correlation of the curvatures between two bones. Its inverse is the covariance whatever the
/// others do (Laplace's approximation). Empty if a pose has no finite covariance.
Eigen::MatrixXd root_of_covariance(const std::vector<Pose>& poses, const JointCost& cost);

}  // namespace marrow::together
