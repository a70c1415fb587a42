// SPDX-License-Identifier: Apache-2.0
#include "least_squares.hpp"

#include <cmath>

#include "marrow/domain/decompositions.hpp"

namespace marrow::robot {

LeastSquares least_squares(const std::function<Eigen::VectorXd(const Eigen::VectorXd&)>& residuals,
                           const Eigen::VectorXd& step, int most_rounds) {
  constexpr double kLeastGain = 1e-10;  // relative
  LeastSquares best{Eigen::VectorXd::Zero(step.size()), {}, 0};
  Eigen::VectorXd now = residuals(best.change);
  best.sum = now.squaredNorm();
  double damping = 1e-3;
  for (int round = 0; round < most_rounds; ++round) {
    Eigen::MatrixXd slopes(now.size(), step.size());
    for (Eigen::Index i = 0; i < step.size(); ++i) {
      Eigen::VectorXd more = best.change, less = best.change;
      more[i] += step[i], less[i] -= step[i];
      slopes.col(i) = (residuals(more) - residuals(less)) / (2 * step[i]);
    }
    best.hessian = slopes.transpose() * slopes;
    const Eigen::VectorXd downhill = -slopes.transpose() * now;
    bool is_better = false;
    double gain = 0;
    for (int attempt = 0; attempt < 8 && !is_better; ++attempt) {
      Eigen::MatrixXd damped = best.hessian;
      damped.diagonal() *= 1 + damping;
      damped.diagonal().array() += 1e-12;
      const Eigen::VectorXd next = best.change + solve_symmetric<Eigen::Dynamic>(damped, downhill);
      const Eigen::VectorXd then = residuals(next);
      is_better = then.squaredNorm() < best.sum;
      damping *= is_better ? 0.2 : 5;
      if (!is_better) continue;
      gain = best.sum - then.squaredNorm();
      best.change = next, now = then, best.sum = then.squaredNorm();
    }
    if (gain <= kLeastGain * best.sum) break;
  }
  return best;
}

}  // namespace marrow::robot
