// SPDX-License-Identifier: Apache-2.0
#pragma once
// PCL's iterative closest point (ICP) with a plain interface, so that only one file includes PCL's headers.
#include <Eigen/Core>
#include <vector>

namespace marrow::closest_points {

struct Settings {
  int max_iterations = 100;
  double reach = 10;  ///< pairs farther apart do not count, in the unit of the points
};

struct Result {
  Eigen::Matrix4d motion = Eigen::Matrix4d::Identity();  ///< moves the points onto the target
  bool converged = false;                                ///< false also if max_iterations was reached
  std::size_t paired = 0;  ///< number of points that have a target point within reach after the motion
  double rms = 0;          ///< root mean square distance of these pairs
};

/// Aligns points to a target by ICP. Both are in the same frame and near the origin, because PCL uses single precision.
Result align(const std::vector<Eigen::Vector3d>& points, const std::vector<Eigen::Vector3d>& target,
             const Settings& settings);

}  // namespace marrow::closest_points
