// SPDX-License-Identifier: Apache-2.0
#include <marrow/plugin.hpp>

#include "marrow/optimizer/nlopt_run.hpp"

namespace {

class NelderMead : public marrow::Optimizer {
 public:
  marrow::MinimisationResult minimise(const marrow::MinimisationProblem& problem) const override {
    return marrow::search::NloptRun(nlopt::LN_NELDERMEAD, problem).run();
  }
};

std::shared_ptr<const marrow::Optimizer> nelder_mead() { return std::make_shared<NelderMead>(); }

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("optimizer.nelder_mead", nelder_mead)
      .summary("Downhill simplex (Nelder and Mead, Computer Journal 1965; by NLopt)")
      .trait("needs_start")
      .out("optimizer", "minimiser without derivatives");
}
