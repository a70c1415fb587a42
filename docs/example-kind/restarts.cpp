// A decorator: an optimizer that starts another one from several places.
#include <marrow/plugin.hpp>
#include <random>

namespace {
struct Options {
  int starts = 3;
};

struct Restarts : marrow::Optimizer {
  Restarts(const marrow::Optimizer& one, int count) : inner(one), starts(count) {}
  marrow::MinimisationResult minimise(const marrow::MinimisationProblem& problem) const override {
    std::mt19937 random(1);
    marrow::MinimisationResult best;
    for (int start = 0, left = problem.max_evaluations; start < starts && left > 0; ++start) {
      marrow::MinimisationProblem one = problem;
      one.max_evaluations = std::max(1, left / (starts - start));
      for (Eigen::Index i = 0; start > 0 && i < one.start.size(); ++i)
        one.start[i] += one.initial_step[i] * (double(random()) / 2147483648.0 - 1);
      if (one.lower.size()) one.start = one.start.cwiseMax(one.lower).cwiseMin(one.upper);
      marrow::MinimisationResult result = inner.minimise(one);
      left -= result.evaluations;
      result.evaluations += best.evaluations;
      if (start > 0 && !(result.value < best.value)) std::swap(result.x, best.x), result.value = best.value;
      best = result;
    }
    return best;
  }
  const marrow::Optimizer& inner;
  const int starts;
};

std::shared_ptr<const marrow::Optimizer> restarts(const marrow::Optimizer& inner, const Options& options) {
  return std::make_shared<Restarts>(inner, options.starts);
}
}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("optimizer.restarts", restarts)
      .summary("Another optimizer from several places")
      .trait("needs_start")
      .in("inner", "the optimizer that is started")
      .out("optimizer", "the best of all starts")
      .option("starts", &Options::starts, "how many", marrow::at_least(1));
}
