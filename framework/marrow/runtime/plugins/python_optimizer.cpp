// SPDX-License-Identifier: Apache-2.0
// Optimizers written in Python: a process minimises, and asks back for the values of the function.
#include <cmath>
#include <limits>

#include "marrow/runtime/plugins/python_functions.hpp"

namespace marrow {
namespace {

using nlohmann::json;

std::vector<double> numbers_of(const Eigen::VectorXd& x) { return {x.data(), x.data() + x.size()}; }

class PythonOptimizer : public Optimizer {
 public:
  explicit PythonOptimizer(PythonFunction function) : function_(std::move(function)) {}

  /// The result is the best point whose value the process asked for. JSON writes numbers that are not finite as null.
  MinimisationResult minimise(const MinimisationProblem& problem) const override {
    MinimisationResult result;
    result.x = problem.start;
    result.value = std::numeric_limits<double>::infinity();
    const json answer = function_.ask({{"do", "minimise"},
                                       {"start", numbers_of(problem.start)},
                                       {"initial_step", numbers_of(problem.initial_step)},
                                       {"lower", numbers_of(problem.lower)},
                                       {"upper", numbers_of(problem.upper)},
                                       {"max_evaluations", problem.max_evaluations},
                                       {"step_tolerance", problem.step_tolerance}},
                                      nullptr, [&](const json& question) { return values(problem, question, result); });
    result.stopped_because = answer.at("stopped_because");
    return result;
  }

 private:
  static json values(const MinimisationProblem& problem, const json& question, MinimisationResult& result) {
    const auto numbers = question.at("points").get<std::vector<double>>();
    const Eigen::Index size = problem.start.size();
    json values = json::array();
    for (Eigen::Index first = 0; first + size <= Eigen::Index(numbers.size()); first += size) {
      const Eigen::VectorXd x = Eigen::Map<const Eigen::VectorXd>(numbers.data() + first, size);
      const double value = problem.function(x);
      ++result.evaluations;
      if (problem.observer) problem.observer(result.evaluations, x, value);
      values.push_back(value);
      if (!(value < result.value)) continue;
      result.value = value;
      result.x = x;
    }
    return values;
  }

  PythonFunction function_;
};

}  // namespace

std::shared_ptr<const Optimizer> python_optimizer(PythonFunction function) {
  return std::make_shared<const PythonOptimizer>(std::move(function));
}

}  // namespace marrow
