// SPDX-License-Identifier: Apache-2.0
// A plain search along the coordinates, and others that are wrong in one way each: the suite must catch each of them.

#include "wrong.hpp"

namespace {

template <wrong::Fault fault>
class Search : public marrow::Optimizer {
 public:
  marrow::MinimisationResult minimise(const marrow::MinimisationProblem& problem) const override {
    const double tolerance = problem.step_tolerance;
    if (!(fault == "trusting") &&
        (problem.start.size() == 0 || !problem.start.allFinite() || !(tolerance > 0) || !std::isfinite(tolerance)))
      throw marrow::Error("this problem makes no sense");
    marrow::MinimisationResult result{problem.start, INFINITY, 0, "steps are below the tolerance"};
    const int budget = problem.max_evaluations + (fault == "spending" ? 3 : 0);
    const auto value = [&](Eigen::VectorXd& x) {
      if (!(fault == "unbounded") && problem.lower.size()) x = x.cwiseMax(problem.lower).cwiseMin(problem.upper);
      ++result.evaluations;
      const double v = problem.function(x);
      return fault == "fooled" || std::isfinite(v) ? v : 1e300;
    };
    result.value = value(result.x);
    double step = fault == "changing" ? 1 + 0.01 * wrong::next_call() : 1;
    while (!(fault == "lazy") && (fault == "tireless" || step > tolerance)) {
      bool any = false;
      for (Eigen::Index i = 0; i < result.x.size(); ++i)
        for (const double sign : {1.0, -1.0}) {
          if (result.evaluations >= budget) return result;
          Eigen::VectorXd x = result.x;
          x[i] += sign * step * problem.initial_step[i];
          const double v = value(x);
          if (v >= result.value) continue;  // never true for NaN
          result.x = x;
          result.value = v;
          any = true;
        }
      if (!any) step *= 0.5;
    }
    if (!(fault == "inventive") && result.value >= 1e300) throw marrow::Error("there is no least value");
    return result;
  }
};

template <wrong::Fault fault>
std::shared_ptr<const marrow::Optimizer> make() {
  return std::make_shared<Search<fault>>();
}

}  // namespace

MARROW_PLUGIN(plugin) {
  wrong::declare<"plain", "lazy", "spending", "unbounded", "fooled", "changing", "tireless", "trusting", "inventive">(
      plugin, "optimizer", []<wrong::Fault fault>() { return &make<fault>; },
      [](auto&& node) { node.trait("needs_start").out("optimizer", "minimiser"); });
}
