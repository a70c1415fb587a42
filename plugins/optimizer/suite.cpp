// SPDX-License-Identifier: Apache-2.0
// Checks for optimizers on functions of six variables with a known minimum: a bowl, a long bowl, a bent valley, and a
// function with many local minima for optimizers that need no start near the minimum. Each runs from ten starts, with
// 1500 evaluations.
#include <algorithm>
#include <cmath>
#include <marrow/plugin.hpp>
#include <random>
#include <thread>

namespace marrow::conformance {
namespace {

constexpr int kBudget = 1500, kStarts = 10;
constexpr Eigen::Index kSize = 6;

using Function = double (*)(const Eigen::VectorXd&);

// All functions have their minimum, 0, at the origin.
double sphere(const Eigen::VectorXd& x) { return x.squaredNorm(); }
double ellipsoid(const Eigen::VectorXd& x) {
  double sum = 0;
  for (Eigen::Index i = 0; i < x.size(); ++i) sum += std::pow(100.0, double(i) / double(x.size() - 1)) * x[i] * x[i];
  return sum;
}
double rosenbrock(const Eigen::VectorXd& x) {
  double sum = 0;
  for (Eigen::Index i = 0; i + 1 < x.size(); ++i)
    sum += 10 * std::pow(x[i + 1] + 1 - (x[i] + 1) * (x[i] + 1), 2) + x[i] * x[i];
  return sum;
}
double rastrigin(const Eigen::VectorXd& x) {
  double sum = 0;
  for (const double d : x) sum += d * d + 2 * (1 - std::cos(2 * kPi * d));
  return sum;
}

const Optimizer& optimizer_of(const std::vector<Value>& outputs) {
  expect(outputs.size() == 1 && outputs[0].data, "it gives no optimizer");
  return *static_cast<const Optimizer*>(outputs[0].data.get());
}

/// The node's optimizer; the result keeps it alive.
struct Made {
  Result result;
  const Optimizer& operator*() const { return optimizer_of(result.outputs); }
};
Made made(const Subject& subject) {
  Made one{subject.call({})};
  if (one.result.refusal) throw Failure("it refuses: " + *one.result.refusal);
  return one;
}

MinimisationProblem problem_of(const std::function<double(const Eigen::VectorXd&)>& function, int start) {
  std::mt19937 random(std::uint32_t(start) + 1);
  MinimisationProblem problem;
  problem.function = function;
  problem.start.resize(kSize);
  for (double& x : problem.start) x = 4 * (double(random()) / 4294967296.0 - 0.5);
  problem.initial_step = Eigen::VectorXd::Constant(kSize, 0.7);
  problem.max_evaluations = kBudget;
  problem.step_tolerance = 1e-4;
  return problem;
}

void validate(const Inputs&, const std::vector<PortInfo>&, const std::vector<Value>& outputs) {
  const MinimisationProblem problem = problem_of(sphere, 0);
  const MinimisationResult result = optimizer_of(outputs).minimise(problem);
  expect(result.x.size() == kSize && result.x.allFinite() && std::isfinite(result.value),
         "its result is not finite, or of another size");
  expect(std::abs(sphere(result.x) - result.value) <= 1e-12 * (1 + result.value),
         "the value that it gives is not that of the point that it gives");
  expect(!result.stopped_because.empty(), "it does not say why it stopped");
}

/// The value at the end in % of the value at the start: the eighth best of ten starts.
double left_percent(const Subject& subject, Function function) {
  const Made optimizer = made(subject);
  std::vector<double> left;
  for (int start = 0; start < kStarts; ++start) {
    const MinimisationProblem problem = problem_of(function, start);
    left.push_back(100 * function((*optimizer).minimise(problem).x) / function(problem.start));
  }
  std::sort(left.begin(), left.end());
  return left[kStarts - 3];
}

double evaluations_over_budget(const Subject& subject) {
  const Made optimizer = made(subject);
  int worst = 0;
  for (const int budget : {1, 7, 100}) {
    int calls = 0;
    MinimisationProblem problem = problem_of(
        [&](const Eigen::VectorXd& x) {
          ++calls;
          return rosenbrock(x);
        },
        0);
    problem.max_evaluations = budget;
    const MinimisationResult result = (*optimizer).minimise(problem);
    expect(result.evaluations == calls, formatted("it counts {} evaluations of {}", result.evaluations, calls));
    worst = std::max(worst, calls - budget);
  }
  return worst;
}

/// The function's minimum lies beyond the bounds.
double beyond_bounds(const Subject& subject) {
  const Made optimizer = made(subject);
  double beyond = 0;
  MinimisationProblem problem = problem_of(
      [&](const Eigen::VectorXd& x) {
        beyond = std::max({beyond, (Eigen::VectorXd::Constant(kSize, 0.5) - x).maxCoeff(),
                           (x - Eigen::VectorXd::Constant(kSize, 3)).maxCoeff()});
        return sphere(x);
      },
      0);
  problem.start = Eigen::VectorXd::Constant(kSize, 2);
  problem.lower = Eigen::VectorXd::Constant(kSize, 0.5);
  problem.upper = Eigen::VectorXd::Constant(kSize, 3);
  const MinimisationResult result = (*optimizer).minimise(problem);
  beyond = std::max(beyond, (problem.lower - result.x).maxCoeff());
  return beyond <= 1e-9 ? 0 : beyond;
}

double noise_left(const Subject& subject) {
  const Made optimizer = made(subject);
  std::mt19937 random(9);
  const MinimisationProblem problem =
      problem_of([&](const Eigen::VectorXd& x) { return sphere(x) + 0.05 * double(random()) / 4294967296.0; }, 2);
  return 100 * sphere((*optimizer).minimise(problem).x) / sphere(problem.start);
}

double nan_left(const Subject& subject) {
  const Made optimizer = made(subject);
  const MinimisationProblem problem =
      problem_of([](const Eigen::VectorXd& x) { return x[0] > 1.95 || x[1] < -2.2 ? std::nan("") : sphere(x); }, 3);
  const MinimisationResult result = (*optimizer).minimise(problem);
  expect(result.x.allFinite() && std::isfinite(result.value), "it ends in what is not a number");
  return 100 * sphere(result.x) / sphere(problem.start);
}

/// The number of results that differ when the same optimizer runs in four threads at once.
double differing_results(const Subject& subject) {
  const Made optimizer = made(subject);
  const Eigen::VectorXd expected = (*optimizer).minimise(problem_of(rosenbrock, 1)).x;
  std::vector<Eigen::VectorXd> found(4);
  std::vector<std::thread> threads;
  for (Eigen::VectorXd& one : found)
    threads.emplace_back([&] { one = (*optimizer).minimise(problem_of(rosenbrock, 1)).x; });
  for (std::thread& thread : threads) thread.join();
  return double(std::count_if(found.begin(), found.end(), [&](const Eigen::VectorXd& one) { return one != expected; }));
}

/// How many senseless problems the optimizer accepts.
double nonsense_taken(const Subject& subject) {
  const Made optimizer = made(subject);
  std::vector<MinimisationProblem> problems;
  problems.push_back(problem_of(sphere, 0));
  problems.back().start = problems.back().initial_step = Eigen::VectorXd();
  for (const double tolerance : {0.0, -1.0, double(NAN), double(INFINITY)}) {
    problems.push_back(problem_of(sphere, 0));
    problems.back().step_tolerance = tolerance;
  }
  problems.push_back(problem_of(sphere, 0));
  problems.back().start[2] = NAN;
  int taken = 0;
  for (const MinimisationProblem& problem : problems) {
    try {
      (*optimizer).minimise(problem);
      ++taken;
    } catch (const Error&) {
    }
  }
  return taken;
}

/// 1 if the optimizer gives a point as the best although no value is a number.
double best_of_nothing(const Subject& subject) {
  const Made optimizer = made(subject);
  try {
    (*optimizer).minimise(problem_of([](const Eigen::VectorXd&) { return std::nan(""); }, 0));
  } catch (const Error&) {
    return 0;
  }
  return 1;
}

/// Evaluations until the steps are below a coarse tolerance, in % of a budget that need not be spent.
double evaluations_to_tolerance(const Subject& subject) {
  const Made optimizer = made(subject);
  MinimisationProblem problem = problem_of(sphere, 0);
  problem.step_tolerance = 0.1;
  problem.max_evaluations = 20000;
  return 100.0 * (*optimizer).minimise(problem).evaluations / problem.max_evaluations;
}

double lost_exceptions(const Subject& subject) {
  const Made optimizer = made(subject);
  int calls = 0;
  const MinimisationProblem problem = problem_of(
      [&](const Eigen::VectorXd& x) {
        if (++calls == 5) throw Cancelled();
        return sphere(x);
      },
      0);
  try {
    (*optimizer).minimise(problem);
  } catch (const Cancelled&) {
    return calls == 5 ? 0 : 1;  // at once
  }
  return 1;
}

Suite optimizer_suite() {
  Suite suite{[] { return Inputs{}; }, validate, {}, {}};
  const std::string six =
      " of six variables, 1500 evaluations, eighth best of ten starts: final value in percent of the start's value";
  const auto add = [&](const std::string& name, const std::string& what, double limit, const std::string& unit,
                       const std::function<double(const Subject&)>& measure) {
    suite.accuracy.push_back({{name, what, limit, unit}, measure});
  };
  add("sphere", "a bowl" + six, 10, "%", [](const Subject& subject) { return left_percent(subject, sphere); });
  add("ellipsoid", "a bowl 10 times as long as wide" + six, 10, "%",
      [](const Subject& subject) { return left_percent(subject, ellipsoid); });
  add("rosenbrock", "a bent valley" + six, 20, "%",
      [](const Subject& subject) { return left_percent(subject, rosenbrock); });
  add("rastrigin", "a function with many local minima" + six, 25, "%", [](const Subject& subject) {
    if (subject.has_trait("needs_start")) throw NotApplicable("it finds the minimum near its start only");
    return left_percent(subject, rastrigin);
  });
  add("budget", "evaluations beyond the allowed number", 0, "evaluations", evaluations_over_budget);
  add("bounds", "largest distance of an evaluated point beyond the bounds", 0, "units", beyond_bounds);
  add("noise", "a bowl with noise: final value in percent of the start's value", 25, "%", noise_left);
  add("not_a_number", "a bowl with NaN in a part of it: final value in percent of the start's value", 10, "%",
      nan_left);
  add("repeated", "results of four simultaneous threads that differ from the result of one thread", 0, "results",
      differing_results);
  add("tolerance", "a bowl of six variables, a step tolerance of 0.1: evaluations in percent of a budget of 20000", 50,
      "%", evaluations_to_tolerance);
  add("nonsense", "accepted problems that have no coordinates, or a start or step tolerance that is not a number", 0,
      "problems", nonsense_taken);
  add("nothing_finite", "results for a function that is NaN everywhere; an error is right", 0, "results",
      best_of_nothing);
  add("exceptions", "exceptions of the function that do not reach the caller", 0, "exceptions", lost_exceptions);
  return suite;
}

}  // namespace
}  // namespace marrow::conformance

MARROW_PLUGIN(plugin) { plugin.suite("optimizer", marrow::conformance::optimizer_suite()); }
