// SPDX-License-Identifier: Apache-2.0
// Checks for registrations on a cost that is a bowl about a known pose, and on a surface at this pose. Where there is
// nothing to compare, no pose may be found: it would be known to a deviation of 0.
#include "suite.hpp"

#include <algorithm>
#include <cmath>

#include "marrow/runtime/node/types.hpp"
#include "marrow/toolbox/analytic/body.hpp"

namespace marrow::conformance {
namespace {

analytic::Body bone() { return {{{0, 0, 8}, {9, 13, 32}}, {{20, -5, -22}, {8, 10, 9}}, {{-17, 7, -25}, {6, 9, 8}}}; }
RigidTransform truth() { return analytic::moved_by({0.2, -0.15, 0.3}, {3, -2, 5}); }
const FragmentFrame& frame() {
  static const FragmentFrame kFrame = fragment_frame(mesh_of(bone()));
  return kFrame;
}

/// From the true pose, in degrees and mm.
Vector6d way(const RigidTransform& pose) {
  Vector6d motion = motion_between(truth(), pose, frame());
  motion.head<3>() *= degrees(1);
  return motion;
}

/// Half the squared way from the truth. Without each of its twelve blocks it is tilted to one side along one axis, so
/// that it is known to 0.1 degree and mm along each.
class Bowl : public Cost {
 public:
  double value(const RigidTransform& pose) const override { return 0.5 * way(pose).squaredNorm(); }
  std::vector<double> without_each_block(const RigidTransform& pose) const override {
    std::vector<double> values;
    for (const double slope : way(pose))
      for (const double side : {-1.0, 1.0}) values.push_back(value(pose) + 0.1 + side * std::sqrt(0.005) * slope);
    return values;
  }
  std::shared_ptr<const Cost> at_level(const CostLevel&) const override { return std::make_shared<Bowl>(*this); }
};

/// A bowl with one view, or with all views, saying that they show nothing.
class Silent : public Bowl {
 public:
  explicit Silent(bool all) : all_(all) {}
  std::string nothing_compared(const RigidTransform&) const override { return all_ ? kSaid : ""; }
  std::vector<std::string> silent_views(const RigidTransform&) const override { return {kSaid}; }
  std::shared_ptr<const Cost> at_level(const CostLevel&) const override { return std::make_shared<Silent>(*this); }
  static constexpr const char* kSaid = "view 'frontal': it is black";

 private:
  bool all_;
};

/// The same at all poses, without a word.
class Constant : public Cost {
 public:
  explicit Constant(double value) : value_(value) {}
  double value(const RigidTransform&) const override { return value_; }
  std::vector<double> without_each_block(const RigidTransform&) const override { return {value_, value_}; }
  std::shared_ptr<const Cost> at_level(const CostLevel&) const override { return std::make_shared<Constant>(*this); }

 private:
  double value_;
};

/// Goes along one coordinate after the other, and halves its steps when no coordinate leads down.
class Compass : public Optimizer {
 public:
  MinimisationResult minimise(const MinimisationProblem& problem) const override {
    MinimisationResult result{problem.start, problem.function(problem.start), 1, "steps are below the tolerance"};
    for (double size = 1; size > problem.step_tolerance && result.evaluations < problem.max_evaluations;) {
      bool is_better = false;
      for (Eigen::Index i = 0; i < problem.start.size(); ++i)
        for (const double sense : {1.0, -1.0}) {
          Eigen::VectorXd x = result.x;
          x[i] += sense * size * problem.initial_step[i];
          const double value = problem.function(x);
          if (problem.observer) problem.observer(++result.evaluations, x, value);
          if (!(value < result.value)) continue;
          result.x = x, result.value = value, is_better = true;
        }
      if (!is_better) size *= 0.5;
    }
    return result;
  }
};

Inputs inputs_of(const std::shared_ptr<const Cost>& cost, const Mesh& target) {
  Vector6d off;
  off << radians(1), radians(-1), radians(2), 1, -1, 2;
  Pose initial;
  initial.frame = frame();
  initial.world_from_model = moved(truth(), initial.frame, off);
  const Value optimizer = Value::of<Optimizer>(std::make_shared<const Compass>());
  return {{"cost", Value::of<Cost>(cost)}, {"finer_cost", Value::of<Cost>(cost)},
          {"optimizer", optimizer},        {"finer_optimizer", optimizer},
          {"start", item(initial)},        {"model", item(mesh_of(bone()))},
          {"target", item(target)}};
}

/// The bone's surface at its true pose, and shifted along x.
Mesh surface(double shift_mm) {
  Mesh mesh = mesh_of(bone());
  mesh.frame = "world";
  for (Eigen::Vector3d& vertex : mesh.vertices_mm) vertex = truth() * vertex + shift_mm * Eigen::Vector3d::UnitX();
  return mesh;
}
Inputs sample() { return inputs_of(std::make_shared<const Bowl>(), surface(0)); }

void validate(const Inputs&, const std::vector<PortInfo>& ports, const std::vector<Value>& outputs) {
  for (std::size_t i = 0; i < outputs.size(); ++i) {
    if (ports[i].name != "pose") continue;
    expect(outputs[i].data != nullptr, "it gives no pose");
    const Pose& pose = outputs[i].as<Pose>();
    check_rigid(pose.world_from_model, "the pose");
    expect(std::isfinite(pose.cost), "the cost of its pose is not finite");
    if (!pose.covariance) continue;
    expect(pose.covariance->allFinite(), "the covariance of its pose is not finite");
    expect(pose.covariance->diagonal().minCoeff() > 0, "a predicted deviation of its pose is 0");
  }
}

/// The mean distance between the surface at the pose that is found and at the truth.
double off_mm(const Subject& subject) {
  const RigidTransform found = subject.output(sample(), "pose").as<Pose>().world_from_model;
  const std::vector<Eigen::Vector3d> points = sample_surface(mesh_of(bone()), 200);
  double sum = 0;
  for (const Eigen::Vector3d& point : points) sum += (found * point - truth() * point).norm();
  return sum / double(points.size());
}

bool takes(const Subject& subject, const std::string& input) {
  const auto& ports = subject.info().inputs;
  return std::any_of(ports.begin(), ports.end(), [&](const PortInfo& one) { return one.name == input; });
}
bool takes_a_cost(const Subject& subject) { return takes(subject, "cost"); }

/// The number of inputs without anything to compare that lead to a pose.
double poses_of_nothing(const Subject& subject) {
  std::vector<Inputs> of_nothing;
  if (takes_a_cost(subject)) {
    for (const double value : {0.0, 0.7, std::nan("")})
      of_nothing.push_back(inputs_of(std::make_shared<const Constant>(value), surface(0)));
    of_nothing.push_back(inputs_of(std::make_shared<const Silent>(true), surface(0)));
  } else {
    of_nothing.push_back(inputs_of(std::make_shared<const Bowl>(), surface(1000)));
  }
  double count = 0;
  for (const Inputs& inputs : of_nothing) {
    const Result result = subject.call(inputs);
    if (result.refusal) expect_reason(*result.refusal);
    count += !result.refusal;
  }
  return count;
}

double views_not_named(const Subject& subject) {
  if (!takes_a_cost(subject)) throw NotApplicable("it takes no cost");
  const Inputs inputs = inputs_of(std::make_shared<const Silent>(false), surface(0));
  const std::vector<std::string> warnings = subject.output(inputs, "pose").as<Pose>().warnings;
  return std::none_of(warnings.begin(), warnings.end(),
                      [](const std::string& text) { return text.find(Silent::kSaid) != std::string::npos; });
}

/// The angle between the model's long axis and that of the pose, from a start that has no axes of its own.
double long_axis_off_deg(const Subject& subject) {
  if (!takes(subject, "model")) throw NotApplicable("it takes no model");
  Inputs inputs = sample();
  Pose initial = inputs.at("start").as<Pose>();
  initial.frame = {};
  inputs.set("start", item(initial));
  const FragmentFrame found = subject.output(inputs, "pose").as<Pose>().frame;
  return degrees(found.axes.col(2).cross(frame().axes.col(2)).norm());
}

std::vector<Trial> trials() {
  const auto with_start = [](const std::function<void(Pose&)>& change) {
    return [change] {
      Inputs inputs = sample();
      Pose initial = inputs.at("start").as<Pose>();
      change(initial);
      inputs.set("start", item(initial));
      return inputs;
    };
  };
  return {
      {"start_not_a_number", with_start([](Pose& start) { start.world_from_model.translation_mm.x() = std::nan(""); })},
      {"start_not_rigid", with_start([](Pose& start) { start.world_from_model.rotation *= 2; })},
      {"start_far_off", with_start([](Pose& start) { start.world_from_model.translation_mm.z() += 500; })},
      {"start_with_deviations_of_0", with_start([](Pose& start) { start.covariance = Matrix6d(Matrix6d::Zero()); })},
      {"no_surface", [] {
         Inputs inputs = sample();
         inputs.set("model", item(Mesh()));
         inputs.set("target", item(Mesh()));
         return inputs;
       }}};
}

}  // namespace

Suite register_suite() {
  Suite suite;
  suite.sample = sample;
  suite.validate = validate;
  suite.trials = trials();
  suite.accuracy = {
      {{"truth", "mean distance of the surface from the true pose, from a start 4 degrees and mm off", 0.5, "mm"},
       off_mm},
      {{"nothing_compared",
        "poses found where the cost is constant, is not a number, or says that it compares nothing, or where no "
        "surface is within reach",
        0, "poses"},
       poses_of_nothing},
      {{"silent_view", "poses without a warning that names a view that says nothing, where others do", 0, "poses"},
       views_not_named},
      {{"long_axis", "the long axis of the pose from that of the model, if the start has no axes", 1e-3, "deg"},
       long_axis_off_deg}};
  return suite;
}

}  // namespace marrow::conformance
