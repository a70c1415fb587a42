// SPDX-License-Identifier: Apache-2.0
#include <marrow/plugin.hpp>

#include "marrow/optimizer/nlopt_run.hpp"

namespace {

marrow::MinimisationResult minimise(const marrow::MinimisationProblem& problem) {
  return marrow::optimizer::NloptRun(nlopt::LN_SBPLX, problem).run();
}

std::shared_ptr<const marrow::Optimizer> sbplx() { return marrow::optimizer::optimizer_of(minimise); }

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("optimizer.sbplx", sbplx)
      .summary("Downhill simplex on subspaces (Subplex: Rowan 1990; NLopt's version)")
      .trait("needs_start")
      .out("optimizer", "minimiser without derivatives");
}
