// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <Eigen/Core>
#include <functional>

namespace marrow::robot {

/// The least sum of squares near a start, by Levenberg and Marquardt's steps with central differences. `residuals(x)`
/// gives the residuals after a small change x from the start; `step`: of the differences, for each number.
struct LeastSquares {
  Eigen::VectorXd change;   ///< from the start
  Eigen::MatrixXd hessian;  ///< J^T J at the end
  double sum = 0;           ///< of the squares
};
LeastSquares least_squares(const std::function<Eigen::VectorXd(const Eigen::VectorXd&)>& residuals,
                           const Eigen::VectorXd& step, int most_rounds);

}  // namespace marrow::robot
