// SPDX-License-Identifier: Apache-2.0
#pragma once
// How long a normally distributed vector may be.
#include <Eigen/Core>

namespace marrow::plan {

/// The length that a vector in a plane does not exceed with this probability (above 0, below 1), if it is normally
/// distributed around zero. `covariance` is that of the plane's vectors in space, so its least eigenvalue is 0. The
/// result is exact for any ratio of the other two: 1.96 deviations along a line, 2.45 in a circle. It is NaN or
/// infinite if a variance is.
double length_quantile(const Eigen::Matrix3d& covariance, double probability);

}  // namespace marrow::plan
