// SPDX-License-Identifier: Apache-2.0
#include <marrow/plugin.hpp>

#include "marrow/toolbox/search/nlopt_run.hpp"

namespace {

class Bobyqa : public marrow::Optimizer {
 public:
  marrow::MinimisationResult minimise(const marrow::MinimisationProblem& problem) const override {
    if (problem.start.size() < 2)
      throw marrow::Error("BOBYQA minimises functions of two or more numbers, got " +
                          std::to_string(problem.start.size()) + "; use another optimizer");
    return marrow::search::NloptRun(nlopt::LN_BOBYQA, problem).run();
  }
};

std::shared_ptr<const marrow::Optimizer> bobyqa() { return std::make_shared<Bobyqa>(); }

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("optimizer.bobyqa", bobyqa)
      .summary("Quadratic models in a trust region, without derivatives (BOBYQA: Powell 2009; by NLopt)")
      .trait("needs_start")
      .out("optimizer", "minimiser without derivatives");
}
