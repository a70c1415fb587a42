// SPDX-License-Identifier: Apache-2.0
#pragma once
// PCL's iterative closest points behind plain numbers, so that its headers are parsed in one file.
#include <Eigen/Core>
#include <vector>

namespace marrow::match {

struct Settings {
  int max_iterations = 100;
  double reach = 10;  ///< pairs further apart do not count
};

struct Result {
  Eigen::Matrix4d motion = Eigen::Matrix4d::Identity();  ///< moves the points onto the target
  bool converged = false;
  std::size_t paired = 0;  ///< points that have one of the target in reach, at the end
  double rms = 0;          ///< distance of these pairs
};

/// Points and target in the same frame, both near the origin: PCL keeps them in single precision.
Result align(const std::vector<Eigen::Vector3d>& points, const std::vector<Eigen::Vector3d>& target,
             const Settings& settings);

}  // namespace marrow::match
