// SPDX-License-Identifier: Apache-2.0
#include <marrow/plugin.hpp>

#include "marrow/toolbox/search/nlopt_run.hpp"

namespace {

struct Options {
  double reach = 10;
};

class Direct : public marrow::Optimizer {
 public:
  explicit Direct(double reach) : reach_(reach) {}
  marrow::MinimisationResult minimise(const marrow::MinimisationProblem& problem) const override {
    marrow::search::check_problem(problem);
    marrow::MinimisationProblem bounded = problem;
    if (bounded.lower.size() == 0) bounded.lower = problem.start - reach_ * problem.initial_step;
    if (bounded.upper.size() == 0) bounded.upper = problem.start + reach_ * problem.initial_step;
    return marrow::search::NloptRun(nlopt::GN_DIRECT_L, bounded).run();
  }

 private:
  const double reach_;
};

std::shared_ptr<const marrow::Optimizer> direct(const Options& options) {
  return std::make_shared<Direct>(options.reach);
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("optimizer.direct", direct)
      .summary(
          "Divides the whole range into boxes, and promising boxes into smaller ones (DIRECT-L: Gablonsky and Kelley "
          "2001; by NLopt)")
      .out("optimizer", "global minimiser without derivatives")
      .option("reach", &Options::reach,
              "range to either side of the start if the problem has no bounds, in units of the initial steps",
              marrow::at_least(1e-3), marrow::unit("1"));
}
