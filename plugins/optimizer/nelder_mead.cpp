// SPDX-License-Identifier: Apache-2.0
#include <marrow/plugin.hpp>

#include "marrow/optimizer/nlopt_run.hpp"

namespace {

marrow::MinimisationResult minimise(const marrow::MinimisationProblem& problem) {
  return marrow::optimizer::NloptRun(nlopt::LN_NELDERMEAD, problem).run();
}

std::shared_ptr<const marrow::Optimizer> nelder_mead() { return marrow::optimizer::optimizer_of(minimise); }

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("optimizer.nelder_mead", nelder_mead)
      .summary("Downhill simplex (Nelder and Mead, Computer Journal 1965; by NLopt)")
      .trait("needs_start")
      .out("optimizer", "minimiser without derivatives");
}
