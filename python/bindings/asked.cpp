// SPDX-License-Identifier: Apache-2.0
// Functions among the inputs of a node written in Python. They stay in the process that runs the pipeline
// (marrow/runtime/plugins/asked_functions.hpp), which is asked for what they give.
#include <pybind11/stl.h>

#include <cmath>
#include <limits>

#include "asked.hpp"
#include "marrow/domain/functions.hpp"
#include "values.hpp"

namespace marrow::python {
namespace {

// JSON has no numbers that are not finite: None stands for them.
py::list listed(const Eigen::VectorXd& x) {
  py::list numbers;
  for (const double number : x) numbers.append(std::isfinite(number) ? py::object(py::float_(number)) : py::none());
  return numbers;
}
double number_of(const py::handle& object) {
  return object.is_none() ? std::numeric_limits<double>::quiet_NaN() : object.cast<double>();
}

class AskedCost : public Cost {
 public:
  explicit AskedCost(Asked asked) : asked_(std::move(asked)) {}

  double value(const RigidTransform& pose) const override { return values({pose}).at(0); }
  std::vector<double> values(const std::vector<RigidTransform>& poses) const override {
    return numbers("values", poses);
  }
  std::shared_ptr<const Cost> at_level(const CostLevel& level) const override {
    return std::make_shared<const AskedCost>(
        asked_.changed({level.contour_spacing_px, level.reach_px, double(level.pixel_step)}));
  }
  std::vector<double> without_each_block(const RigidTransform& pose) const override {
    return numbers("without_each_block", {pose});
  }
  std::size_t view_count() const override {
    std::size_t count = 0;
    asked_.ask([](py::dict& question) { question["do"] = "view_count"; },
               [&](const py::object& reply) { count = reply.cast<std::size_t>(); });
    return count;
  }
  double value_in_view(std::size_t view, const RigidTransform& pose) const override {
    double value = 0;
    asked_.ask(
        [&](py::dict& question) {
          question["do"] = "value_in_view";
          question["view"] = view;
          question["poses"] = listed_transforms(std::vector{pose});
        },
        [&](const py::object& reply) { value = number_of(reply); });
    return value;
  }
  std::string nothing_compared(const RigidTransform& pose) const override {
    std::string text;
    about("nothing_compared", {pose}, [&](const py::object& reply) { text = reply.cast<std::string>(); });
    return text;
  }
  std::vector<std::string> silent_views(const RigidTransform& pose) const override {
    std::vector<std::string> texts;
    about("silent_views", {pose}, [&](const py::object& reply) { texts = reply.cast<std::vector<std::string>>(); });
    return texts;
  }

 private:
  void about(const char* what, const std::vector<RigidTransform>& poses,
             const std::function<void(const py::object&)>& read) const {
    asked_.ask(
        [&](py::dict& question) {
          question["do"] = what;
          question["poses"] = listed_transforms(poses);
        },
        read);
  }
  std::vector<double> numbers(const char* what, const std::vector<RigidTransform>& poses) const {
    std::vector<double> all;
    if (poses.empty()) return all;
    about(what, poses, [&](const py::object& reply) {
      for (const py::handle& one : reply) all.push_back(number_of(one));
    });
    return all;
  }

  Asked asked_;
};

/// Minimises in the other process, which asks back for the values of the function.
class AskedOptimizer : public Optimizer {
 public:
  explicit AskedOptimizer(Asked asked) : asked_(std::move(asked)) {}

  MinimisationResult minimise(const MinimisationProblem& problem) const override {
    int evaluations = 0;
    const py::gil_scoped_acquire acquire;
    const py::object values = py::cpp_function([&](const std::vector<double>& point) {
      const py::gil_scoped_release release;
      const Eigen::VectorXd x = Eigen::Map<const Eigen::VectorXd>(point.data(), Eigen::Index(point.size()));
      const double value = problem.function(x);
      if (problem.observer) problem.observer(++evaluations, x, value);
      return value;
    });
    MinimisationResult result;
    asked_.ask(
        [&](py::dict& question) {
          question["do"] = "minimise";
          question["start"] = listed(problem.start);
          question["initial_step"] = listed(problem.initial_step);
          question["lower"] = listed(problem.lower);
          question["upper"] = listed(problem.upper);
          question["max_evaluations"] = problem.max_evaluations;
          question["step_tolerance"] = problem.step_tolerance;
        },
        [&](const py::object& reply) {
          const auto x = reply["x"].cast<std::vector<double>>();
          result.x = Eigen::Map<const Eigen::VectorXd>(x.data(), Eigen::Index(x.size()));
          result.value = number_of(reply["value"]);
          result.evaluations = reply["evaluations"].cast<int>();
          result.stopped_because = reply["stopped_because"].cast<std::string>();
        },
        &values);
    return result;
  }

 private:
  Asked asked_;
};

Value asked_value(const std::string& type, Asked asked) {
  if (type == TypeInfo::of<Cost>().id) return Value::of<Cost>(std::make_shared<const AskedCost>(std::move(asked)));
  if (type == TypeInfo::of<Optimizer>().id)
    return Value::of<Optimizer>(std::make_shared<const AskedOptimizer>(std::move(asked)));
  return asked_projector(type, std::move(asked));
}

}  // namespace

py::list listed_transforms(const std::vector<RigidTransform>& transforms) {
  py::list numbers;
  for (const RigidTransform& one : transforms)
    for (int row = 0; row < 3; ++row) {
      for (int column = 0; column < 3; ++column) numbers.append(one.rotation(row, column));
      numbers.append(one.translation_mm[row]);
    }
  return numbers;
}

void bind_asked(py::module_& module) {
  module.def(
      "asked_function",
      [](const std::string& type, std::uint64_t function, const std::string& key, const py::object& ask) {
        Value value = asked_value(type, Asked(ask, function));
        value.key = digest_of_hex(key).value();
        return python_of(value);
      },
      "A function of the process that runs the pipeline, by its number among the inputs of a call.");
}

}  // namespace marrow::python
