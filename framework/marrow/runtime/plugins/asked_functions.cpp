// SPDX-License-Identifier: Apache-2.0
#include "marrow/runtime/plugins/asked_functions.hpp"

#include <cmath>
#include <limits>

#include "marrow/base/error.hpp"
#include "marrow/base/number_text.hpp"

namespace marrow {
namespace {

using nlohmann::json;

/// JSON has no numbers that are not finite: it has null where `other` is meant.
Eigen::VectorXd vector_of(const json& numbers, double other = std::nan("")) {
  Eigen::VectorXd vector(numbers.size());
  for (std::size_t i = 0; i < numbers.size(); ++i)
    vector[Eigen::Index(i)] = numbers[i].is_number() ? numbers[i].get<double>() : other;
  return vector;
}

CostLevel level_of(const json& numbers) { return {numbers.at(0), numbers.at(1), numbers.at(2)}; }

/// Minimises the process's own function.
json minimised(const Optimizer& optimizer, const json& question, const AskProcess& ask_process) {
  MinimisationProblem problem;
  problem.function = [&](const Eigen::VectorXd& x) {
    json own;
    own["point"] = std::vector<double>(x.data(), x.data() + x.size());
    const json value = ask_process(own);
    return value.is_number() ? value.get<double>() : std::nan("");
  };
  problem.start = vector_of(question.at("start"));
  problem.initial_step = vector_of(question.at("initial_step"));
  constexpr double kInfinite = std::numeric_limits<double>::infinity();
  problem.lower = vector_of(question.at("lower"), -kInfinite);
  problem.upper = vector_of(question.at("upper"), kInfinite);
  problem.max_evaluations = question.at("max_evaluations");
  problem.step_tolerance = question.at("step_tolerance");
  const MinimisationResult result = optimizer.minimise(problem);
  return {{"x", std::vector<double>(result.x.data(), result.x.data() + result.x.size())},
          {"value", result.value},
          {"evaluations", result.evaluations},
          {"stopped_because", result.stopped_because}};
}

json asked_of_cost(const Cost& cost, const json& question) {
  const std::string what = question.at("do");
  if (what == "view_count") return cost.view_count();
  const std::vector<RigidTransform> poses = transforms_of(question.at("poses"));
  if (what == "values") return cost.values(poses);
  if (what == "without_each_block") return cost.without_each_block(poses.at(0));
  if (what == "value_in_view") return cost.value_in_view(question.at("view"), poses.at(0));
  if (what == "nothing_compared") return cost.nothing_compared(poses.at(0));
  if (what == "silent_views") return cost.silent_views(poses.at(0));
  throw Error("a cost was asked for '" + what + "'");
}

}  // namespace

json AskedFunctions::add(const Value& function) {
  functions_.push_back(function);
  return {{"function", functions_.size() - 1}, {"type", function.type.id}};
}

const Value& AskedFunctions::at(std::size_t number) const {
  if (number < functions_.size()) return functions_[number];
  throw Error(formatted("a node asked for function {} of its inputs, but there are {}", number, functions_.size()));
}

std::vector<std::size_t> AskedFunctions::costs() const {
  std::vector<std::size_t> numbers;
  for (std::size_t i = 0; i < functions_.size(); ++i)
    if (functions_[i].type == TypeInfo::of<Cost>()) numbers.push_back(i);
  return numbers;
}

const Cost& AskedFunctions::cost_of(const json& question) const {
  const Cost& first = at(question.at("function").get<std::size_t>()).as<Cost>();
  const json levels = question.value("levels", json::array());
  if (levels.empty()) return first;
  const std::string name = question["function"].dump() + levels.dump();
  const std::scoped_lock lock(mutex_);
  std::shared_ptr<const Cost>& known = at_levels_[name];
  if (!known) {
    for (const json& level : levels) known = (known ? *known : first).at_level(level_of(level));
    if (!known) throw Error("a cost has none at another level");
  }
  return *known;
}

json AskedFunctions::reply(const json& question, const AskProcess& ask_process) const {
  const Value& function = at(question.at("function").get<std::size_t>());
  if (function.type == TypeInfo::of<Optimizer>()) return minimised(function.as<Optimizer>(), question, ask_process);
  return asked_of_cost(cost_of(question), question);
}

bool can_be_asked(const TypeInfo& type) { return type == TypeInfo::of<Cost>() || type == TypeInfo::of<Optimizer>(); }

json json_of_transform(const RigidTransform& transform) {
  json numbers = json::array();
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) numbers.push_back(transform.rotation(row, column));
    numbers.push_back(transform.translation_mm[row]);
  }
  return numbers;
}

std::vector<RigidTransform> transforms_of(const json& numbers) {
  const auto all = numbers.get<std::vector<double>>();
  if (all.empty() || all.size() % 12 != 0) throw Error(formatted("{} numbers are no poses of 12 numbers", all.size()));
  std::vector<RigidTransform> transforms(all.size() / 12);
  for (std::size_t i = 0; i < transforms.size(); ++i) {
    using Rows = Eigen::Matrix<double, 3, 4, Eigen::RowMajor>;
    const Rows rows = Eigen::Map<const Rows>(all.data() + 12 * i);
    transforms[i] = {"world", "ct", rows.leftCols<3>(), rows.col(3)};
    check_rigid(transforms[i], "a pose whose cost was asked for");
  }
  return transforms;
}

}  // namespace marrow
