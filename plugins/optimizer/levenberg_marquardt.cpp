// SPDX-License-Identifier: Apache-2.0
#include <marrow/plugin.hpp>
#include <string>

#include <marrow/domain/decompositions.hpp>
#include "marrow/optimizer/evaluations.hpp"

namespace {

using Expansion = marrow::MinimisationProblem::Expansion;

/// The expansion of a function without derivatives, by finite differences. Negative eigenvalues of the Hessian are made
/// positive.
Expansion by_differences(marrow::optimizer::Evaluations& evaluate, const Eigen::VectorXd& here, double value,
                         double h) {
  const Eigen::Index n = here.size();
  Expansion about{value, Eigen::VectorXd::Zero(n), Eigen::MatrixXd::Zero(n, n)};
  Eigen::VectorXd above(n);
  const auto shifted = [&](Eigen::Index i, double by_i, Eigen::Index j, double by_j) {
    Eigen::VectorXd y = here;
    y[i] += by_i;
    y[j] += by_j;
    return y;
  };
  for (Eigen::Index i = 0; i < n; ++i) {
    above[i] = evaluate(shifted(i, h, i, 0));
    const double below = evaluate(shifted(i, -h, i, 0));
    about.gradient[i] = (above[i] - below) / (2 * h);
    about.curvature(i, i) = (above[i] - 2 * value + below) / (h * h);
  }
  for (Eigen::Index i = 0; i < n; ++i)
    for (Eigen::Index j = 0; j < i; ++j)
      about.curvature(i, j) = about.curvature(j, i) =
          (evaluate(shifted(i, h, j, h)) - above[i] - above[j] + value) / (h * h);
  const marrow::SymmetricEigen<Eigen::Dynamic> eigen = marrow::eigen_of_symmetric(about.curvature);
  about.curvature = eigen.vectors * eigen.values.cwiseAbs().asDiagonal() * eigen.vectors.transpose();
  return about;
}

/// Damped steps (Marquardt, SIAM J Appl Math 1963). The damping keeps steps short while the expansion is not reliable.
class Search {
 public:
  explicit Search(marrow::optimizer::Evaluations& evaluate)
      : evaluate_(evaluate), here_(Eigen::VectorXd::Zero(evaluate.size())), derivatives_(evaluate.has_derivatives()) {
    value_ = look(here_);
    about_ = seen_;
  }

  std::string run() {
    const double least_h = 0.1 * evaluate_.tolerance();
    for (double h = 0.1;;) {
      if (!about_) about_ = by_differences(evaluate_, here_, value_, h);
      const double moved = step();
      if (moved >= evaluate_.tolerance()) {
        h = std::clamp(0.3 * moved, least_h, h);
      } else if (derivatives_ || h <= least_h) {
        return "steps are below the tolerance";
      } else {
        h = std::max(least_h, 0.1 * h);  // the steps of the differences may be too large to give the slope here
        about_.reset();
      }
    }
  }

 private:
  static constexpr double kLongest = 4, kMostDamping = 1e6;

  /// The value at a point, with derivatives as long as the function provides them.
  double look(const Eigen::VectorXd& there) {
    if (derivatives_) {
      if ((seen_ = evaluate_.expansion(there))) return seen_->value;
      derivatives_ = false;
    }
    seen_.reset();
    return evaluate_(there);
  }

  /// Goes to a point with a lower value and returns the distance. 0 if none was found.
  double step() {
    const Eigen::VectorXd steepness = about_->curvature.diagonal();
    const double floor = 1e-6 * steepness.maxCoeff() + 1e-300;
    for (; damping_ < kMostDamping; damping_ *= 8) {
      Eigen::MatrixXd damped = about_->curvature;
      damped.diagonal() += damping_ * steepness.cwiseMax(floor);
      Eigen::VectorXd step = -marrow::solve_symmetric(damped, about_->gradient);
      if (!step.allFinite()) continue;
      if (step.norm() > kLongest) step *= kLongest / step.norm();
      const Eigen::VectorXd there = evaluate_.within(here_ + step);
      const double moved = (there - here_).norm();
      if (moved < 0.1 * evaluate_.tolerance()) break;
      const double value = look(there);
      if (value >= value_) continue;
      here_ = there;
      value_ = value;
      about_ = seen_;
      damping_ = std::max(0.1 * damping_, 1e-6);
      return moved;
    }
    damping_ = 1e-2;
    return 0;
  }

  marrow::optimizer::Evaluations& evaluate_;
  Eigen::VectorXd here_;
  double value_ = 0, damping_ = 1e-2;
  bool derivatives_;
  std::optional<Expansion> about_, seen_;  ///< at here_, and at the point evaluated last
};

std::shared_ptr<const marrow::Optimizer> levenberg_marquardt() {
  return marrow::optimizer::optimizer_by(
      [](marrow::optimizer::Evaluations& evaluate) { return Search(evaluate).run(); });
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("optimizer.levenberg_marquardt", levenberg_marquardt)
      .summary(
          "Levenberg-Marquardt (Marquardt 1963): damped Gauss-Newton steps if the cost has derivatives, otherwise "
          "damped Newton steps by finite differences")
      .trait("needs_start")
      .out("optimizer", "minimiser for smooth functions");
}
