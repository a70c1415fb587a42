// SPDX-License-Identifier: Apache-2.0
#include <marrow/plugin.hpp>

#include "marrow/optimizer/evaluations.hpp"

namespace {

struct Options {
  int grid_points = 3;
};

/// Evaluates all points of a grid around the best point so far, then of a finer grid around the best of these. The
/// finer grid fills the space up to the neighbouring points of the last grid.
std::string search(marrow::optimizer::Evaluations& evaluate, int points) {
  const Eigen::Index n = evaluate.size();
  Eigen::VectorXd centre = Eigen::VectorXd::Zero(n);
  double least = evaluate(centre);
  const int half = points / 2;
  for (double step = 1; step >= evaluate.tolerance();) {
    Eigen::VectorXd best = centre;
    Eigen::VectorXi at = Eigen::VectorXi::Constant(n, -half);
    for (Eigen::Index k = 0; k < n;) {
      if (at.any()) {
        const Eigen::VectorXd y = evaluate.within(centre + step * at.cast<double>());
        if (const double value = evaluate(y); value < least) least = value, best = y;
      }
      for (k = 0; k < n && ++at[k] > half; ++k) at[k] = -half;
    }
    // If the best point lies at the border, the grid first moves there and becomes finer later.
    if ((best - centre).cwiseAbs().maxCoeff() < (half - 0.5) * step || best == centre) step /= half + 1;
    centre = best;
  }
  return "steps are below the tolerance";
}

std::shared_ptr<const marrow::Optimizer> grid(const Options& options) {
  if (options.grid_points % 2 == 0)
    throw marrow::Error(marrow::formatted(
        "grid_points: expected an odd number, so that the middle is one of them, got {}", options.grid_points));
  return marrow::optimizer::optimizer_by(
      [points = options.grid_points](marrow::optimizer::Evaluations& evaluate) { return search(evaluate, points); });
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("optimizer.grid", grid)
      .summary("Evaluates all points of a grid, then of a finer grid around the best point")
      .trait("needs_start")
      .out("optimizer", "minimiser without derivatives")
      .option("grid_points", &Options::grid_points, "number of grid points along each variable, an odd number",
              marrow::at_least(3), marrow::at_most(101));
}
