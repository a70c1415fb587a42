// SPDX-License-Identifier: Apache-2.0
#include "marrow/runtime/plugins/python_functions.hpp"

#include <atomic>
#include <cmath>
#include <limits>

#include "marrow/base/number_text.hpp"
#include "marrow/runtime/node/types.hpp"

namespace marrow {

using nlohmann::json;

namespace {

/// A process makes the cost once, and gets the poses in batches.
class PythonCost : public Cost {
 public:
  explicit PythonCost(PythonFunction function) : function_(std::move(function)) {}

  double value(const RigidTransform& world_from_model) const override { return values({world_from_model}).at(0); }
  std::vector<double> values(const std::vector<RigidTransform>& world_from_model) const override {
    if (world_from_model.empty()) return {};
    json poses = json::array();
    for (const RigidTransform& pose : world_from_model)
      for (const json& number : json_of_transform(pose)) poses.push_back(number);
    const json answer = function_.ask({{"do", "cost"}, {"poses", poses}});
    auto values = answer.at("values").get<std::vector<double>>();
    if (values.size() != world_from_model.size())
      throw Error(formatted("{} gave {} costs for {} poses", function_.name(), values.size(), world_from_model.size()));
    return values;
  }
  /// It has one resolution only.
  std::shared_ptr<const Cost> at_level(const CostLevel&) const override { return std::make_shared<PythonCost>(*this); }

 private:
  PythonFunction function_;
};

std::vector<double> numbers_of(const Eigen::VectorXd& x) { return {x.data(), x.data() + x.size()}; }

/// A process minimises, and asks back for the values of the function.
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

PythonFunction::PythonFunction(std::shared_ptr<PythonNodes> nodes, NodeInfo node, std::vector<Value> inputs,
                               const std::vector<OptionValue>& options)
    : nodes_(std::move(nodes)), node_(std::move(node)), inputs_(std::move(inputs)), arguments_(inputs_, options) {
  static std::atomic<std::uint64_t> made{0};
  number_ = ++made;
}

json PythonFunction::make(Context& context) const {
  return nodes_->ask(node_, {{"do", "make"}, {"function", number_}}, arguments_, context, nullptr);
}

json PythonFunction::ask(json request, std::vector<Value>* outputs, const PythonNodes::Reply& reply) const {
  Context context;
  request["function"] = number_;
  return nodes_->ask(node_, std::move(request), arguments_, context, outputs, reply);
}

json json_of_transform(const RigidTransform& transform) {
  json numbers = json::array();
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) numbers.push_back(transform.rotation(row, column));
    numbers.push_back(transform.translation_mm[row]);
  }
  return numbers;
}

bool makes_function(const NodeInfo& node) { return node.outputs.size() == 1 && node.outputs[0].type.is_function; }

Value value_of_function(const NodeInfo& node, PythonFunction function, Context& context) {
  const TypeInfo& type = node.outputs.at(0).type;
  if (type == TypeInfo::of<Cost>()) {
    function.make(context);
    return Value::of<Cost>(std::make_shared<const PythonCost>(std::move(function)));
  }
  if (type == TypeInfo::of<Optimizer>())
    return Value::of<Optimizer>(std::make_shared<const PythonOptimizer>(std::move(function)));
  if (type == TypeInfo::of<RadiographProjector>())
    return Value::of<RadiographProjector>(python_projector(std::move(function), context));
  throw Error(node.name + " makes a '" + type.id + "', which cannot be written in Python");
}

}  // namespace marrow
