// SPDX-License-Identifier: Apache-2.0
// A plain search along the coordinates, and others that are wrong in one way each: the suite must catch each of them.
#include <atomic>
#include <cmath>
#include <marrow/plugin.hpp>

namespace {

enum class Fault { none, lazy, spending, unbounded, fooled, changing, tireless, trusting, inventive };

template <Fault fault>
class Search : public marrow::Optimizer {
 public:
  marrow::MinimisationResult minimise(const marrow::MinimisationProblem& problem) const override {
    static std::atomic<int> runs{0};
    const double tolerance = problem.step_tolerance;
    if (fault != Fault::trusting &&
        (problem.start.size() == 0 || !problem.start.allFinite() || !(tolerance > 0) || !std::isfinite(tolerance)))
      throw marrow::Error("this problem makes no sense");
    marrow::MinimisationResult result{problem.start, INFINITY, 0, "steps are below the tolerance"};
    const int budget = problem.max_evaluations + (fault == Fault::spending ? 3 : 0);
    const auto value = [&](Eigen::VectorXd& x) {
      if (fault != Fault::unbounded && problem.lower.size()) x = x.cwiseMax(problem.lower).cwiseMin(problem.upper);
      ++result.evaluations;
      const double v = problem.function(x);
      return fault == Fault::fooled || std::isfinite(v) ? v : 1e300;
    };
    result.value = value(result.x);
    double step = fault == Fault::changing ? 1 + 0.01 * ++runs : 1;
    while (fault != Fault::lazy && (fault == Fault::tireless || step > tolerance)) {
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
    if (fault != Fault::inventive && result.value >= 1e300) throw marrow::Error("there is no least value");
    return result;
  }
};

template <Fault fault>
std::shared_ptr<const marrow::Optimizer> make() {
  return std::make_shared<Search<fault>>();
}

}  // namespace

MARROW_PLUGIN(plugin) {
  const auto add = [&](const char* name, auto* function) {
    plugin.node(name, function).summary("For a test of the suite").trait("needs_start").out("optimizer", "minimiser");
  };
  add("optimizer.plain", make<Fault::none>);
  add("optimizer.lazy", make<Fault::lazy>);
  add("optimizer.spending", make<Fault::spending>);
  add("optimizer.unbounded", make<Fault::unbounded>);
  add("optimizer.fooled", make<Fault::fooled>);
  add("optimizer.changing", make<Fault::changing>);
  add("optimizer.tireless", make<Fault::tireless>);
  add("optimizer.trusting", make<Fault::trusting>);
  add("optimizer.inventive", make<Fault::inventive>);
}
