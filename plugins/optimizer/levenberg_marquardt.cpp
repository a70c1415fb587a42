// SPDX-License-Identifier: Apache-2.0
#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <marrow/plugin.hpp>
#include <string>

#include "differences.hpp"

namespace {

/// The function about a point: value + gradient . d + d . curvature d / 2, the curvature positive.
struct Model {
  Eigen::VectorXd gradient;
  Eigen::MatrixXd curvature;
};

/// Of a sum of squares: curvature 2 J^T J with J by differences (Gauss-Newton). Absent where residuals are not finite.
std::optional<Model> model_of_squares(Evaluations& evaluate, const Eigen::VectorXd& here, double h) {
  const Eigen::VectorXd r = evaluate.residuals(here);
  Eigen::MatrixXd jacobian = Eigen::MatrixXd::Zero(r.size(), here.size());
  for (Eigen::Index i = 0; i < here.size(); ++i) {
    const Sides sides(evaluate, here, i, h);
    if (!(sides.width > 0)) continue;
    const Eigen::VectorXd high = evaluate.residuals(sides.high), low = evaluate.residuals(sides.low);
    if (high.size() != r.size() || low.size() != r.size()) return std::nullopt;
    jacobian.col(i) = (high - low) / sides.width;
  }
  if (r.size() == 0) return std::nullopt;
  return Model{2 * jacobian.transpose() * r, 2 * jacobian.transpose() * jacobian};
}

/// Of any other function: its Hessian by differences, of which the negative eigenvalues are turned positive.
Model model_of_values(Evaluations& evaluate, const Eigen::VectorXd& here, double value, double h) {
  const Eigen::Index n = here.size();
  Model model{Eigen::VectorXd::Zero(n), Eigen::MatrixXd::Zero(n, n)};
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
    model.gradient[i] = (above[i] - below) / (2 * h);
    model.curvature(i, i) = (above[i] - 2 * value + below) / (h * h);
  }
  for (Eigen::Index i = 0; i < n; ++i)
    for (Eigen::Index j = 0; j < i; ++j)
      model.curvature(i, j) = model.curvature(j, i) = (evaluate(shifted(i, h, j, h)) - above[i] - above[j] + value) / (h * h);
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(model.curvature);
  model.curvature = solver.eigenvectors() * solver.eigenvalues().cwiseAbs().asDiagonal() * solver.eigenvectors().transpose();
  return model;
}

/// Damped steps (Marquardt, SIAM J Appl Math 1963): small ones down the slope while the model misleads, whole ones where it holds.
std::string search(Evaluations& evaluate) {
  constexpr double kLongest = 4, kMostDamping = 1e6;
  const double least_h = 0.1 * evaluate.tolerance();
  Eigen::VectorXd here = Eigen::VectorXd::Zero(evaluate.size());
  double value = evaluate(here), damping = 1e-2;
  for (double h = 0.1;;) {
    std::optional<Model> model = evaluate.has_residuals() ? model_of_squares(evaluate, here, h) : std::nullopt;
    if (!model) model = model_of_values(evaluate, here, value, h);
    const double floor = 1e-6 * model->curvature.diagonal().maxCoeff() + 1e-300;
    double moved = 0;
    bool lower = false;
    for (; !lower && damping < kMostDamping; damping *= lower ? 0.1 : 8) {
      Eigen::MatrixXd damped = model->curvature;
      damped.diagonal() += damping * model->curvature.diagonal().cwiseMax(floor);
      Eigen::VectorXd step = -damped.ldlt().solve(model->gradient);
      if (!step.allFinite()) continue;
      if (step.norm() > kLongest) step *= kLongest / step.norm();
      const Eigen::VectorXd there = evaluate.within(here + step);
      moved = (there - here).norm();
      if (moved < 0.3 * evaluate.tolerance()) break;
      const double found = evaluate(there);
      lower = found < value;
      if (lower) here = there, value = found;
    }
    damping = std::clamp(damping, 1e-6, 1e2);
    if (lower && moved >= evaluate.tolerance()) {
      h = std::clamp(0.3 * moved, least_h, h);
    } else if (h > least_h) {
      h = std::max(least_h, 0.1 * h);  // the differences may be too wide to tell the slope here
    } else {
      return "steps are below the tolerance";
    }
  }
}

class LevenbergMarquardt : public marrow::Optimizer {
 public:
  marrow::MinimisationResult minimise(const marrow::MinimisationProblem& problem) const override { return Evaluations(problem).run(search); }
};

std::shared_ptr<const marrow::Optimizer> levenberg_marquardt() { return std::make_shared<LevenbergMarquardt>(); }

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("optimizer.levenberg_marquardt", levenberg_marquardt)
      .summary("Damped Gauss-Newton steps where the cost is a sum of squares, damped Newton steps elsewhere (Levenberg 1944, Marquardt 1963)")
      .out("optimizer", "minimiser for smooth functions");
}
