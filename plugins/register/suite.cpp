// SPDX-License-Identifier: Apache-2.0
// Checks for registrations on a body at a known pose: by a cost that is a bowl about this pose, by its outline in two
// views, and by its surface. Where there is nothing to compare, no pose may be found: it would be known to a deviation
// of 0.
#include <algorithm>
#include <cmath>
#include <marrow/plugin.hpp>
#include <numeric>
#include "marrow/domain/random.hpp"
#include "marrow/toolbox/analytic/functions.hpp"
#include "marrow/toolbox/geometry/targets.hpp"

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

/// A registration of several bones gets one.
template <class T>
Value list_of_one(const T& value) {
  List<T> list;
  list.add("bone", value);
  return Value::of(list, "fragment");
}
void set_start(Inputs& inputs, const Pose& start) {
  inputs.set("start", item(start));
  inputs.set("starts", list_of_one(start));
}

Inputs inputs_of(const std::shared_ptr<const Cost>& cost, const Mesh& target) {
  Vector6d off;
  off << radians(1), radians(-1), radians(2), 1, -1, 2;
  Pose initial;
  initial.frame = frame();
  initial.world_from_model = moved(truth(), initial.frame, off);
  const Value optimizer = Value::of<Optimizer>(std::make_shared<const analytic::Compass>());
  List<Cost> costs;
  costs.add_shared("bone", cost);
  Inputs inputs{{"cost", Value::of<Cost>(cost)},          {"finer_cost", Value::of<Cost>(cost)},
                {"costs", Value::of(costs, "fragment")},  {"optimizer", optimizer},
                {"finer_optimizer", optimizer},           {"model", item(mesh_of(bone()))},
                {"models", list_of_one(mesh_of(bone()))}, {"target", item(target)}};
  set_start(inputs, initial);
  return inputs;
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
double off_mm(const Subject& subject, const Inputs& inputs) {
  static const std::vector<Eigen::Vector3d> kPoints = sample_surface(mesh_of(bone()), 200);
  const RigidTransform found = subject.output(inputs, "pose").as<Pose>().world_from_model;
  return geometry::mean(geometry::target_errors_mm(found, truth(), kPoints));
}

/// The outline of the bone in two views, with errors. It has other minima than the truth, as costs of real images have.
std::shared_ptr<const Cost> outline_in_two_views() {
  constexpr double kSpacing_px = 6, kStep_px = 8, kError_px = 0.5;
  Random random(5);
  std::vector<analytic::SeenBody> views;
  for (const double angle_deg : {0.0, 80.0}) {
    views.push_back(analytic::seen(bone(), analytic::c_arm(angle_deg, 240, 240, 0.8), truth(), kSpacing_px, kStep_px));
    for (Eigen::Vector2d& pixel : views.back().outline_px)
      pixel += kError_px * Eigen::Vector2d{random.normal(), random.normal()};
  }
  return std::make_shared<const analytic::OutlineCost>(bone(), views);
}

/// The distances from the truth of the poses that are found from 20 drawn starts, up to 10 degrees and 10 mm off.
std::vector<double> offs_from_drawn_starts_mm(const Subject& subject) {
  constexpr int kStarts = 20;
  constexpr double kMost = 10;
  Random random(20);
  const auto drawn = [&] {
    Eigen::Vector3d direction;
    for (double& one : direction) one = random.normal();
    return Eigen::Vector3d(direction.normalized() * kMost * random.uniform());
  };
  Inputs inputs = inputs_of(outline_in_two_views(), surface(0));
  std::vector<double> offs_mm;
  for (int i = 0; i < kStarts; ++i) {
    Vector6d motion;
    motion.head<3>() = drawn() * radians(1);
    motion.tail<3>() = drawn();
    Pose start = inputs.at("start").as<Pose>();
    start.world_from_model = moved(truth(), frame(), motion);
    set_start(inputs, start);
    offs_mm.push_back(off_mm(subject, inputs));
  }
  return offs_mm;
}

bool takes(const Subject& subject, const std::string& input) {
  const auto& ports = subject.info().inputs;
  return std::any_of(ports.begin(), ports.end(), [&](const PortInfo& one) { return one.name == input; });
}
bool takes_a_cost(const Subject& subject) { return takes(subject, "cost") || takes(subject, "costs"); }

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
  if (!takes(subject, "model") && !takes(subject, "models")) throw NotApplicable("it takes no model");
  Inputs inputs = sample();
  Pose initial = inputs.at("start").as<Pose>();
  initial.frame = {};
  set_start(inputs, initial);
  const FragmentFrame found = subject.output(inputs, "pose").as<Pose>().frame;
  return degrees(found.axes.col(2).cross(frame().axes.col(2)).norm());
}

std::vector<Trial> trials() {
  const auto with_start = [](const std::function<void(Pose&)>& change) {
    return [change] {
      Inputs inputs = sample();
      Pose initial = inputs.at("start").as<Pose>();
      change(initial);
      set_start(inputs, initial);
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
         inputs.set("models", list_of_one(Mesh()));
         inputs.set("target", item(Mesh()));
         return inputs;
       }}};
}

Suite register_suite() {
  Suite suite;
  suite.sample = sample;
  suite.validate = validate;
  suite.trials = trials();
  const std::string of_starts =
      "mean distance of the surface from the true pose, from 20 drawn starts up to 10 degrees and mm off: ";
  suite.accuracy = {
      {{"truth", "mean distance of the surface from the true pose, from a start 4 degrees and mm off", 0.5, "mm"},
       [](const Subject& subject) { return off_mm(subject, sample()); }},
      {{"starts_mean", of_starts + "the mean", 0.5, "mm"},
       [](const Subject& subject) { return geometry::mean(offs_from_drawn_starts_mm(subject)); }},
      {{"starts_worst", of_starts + "the worst", 1, "mm"},
       [](const Subject& subject) {
         const std::vector<double> offs_mm = offs_from_drawn_starts_mm(subject);
         return *std::max_element(offs_mm.begin(), offs_mm.end());
       }},
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

}  // namespace
}  // namespace marrow::conformance

MARROW_PLUGIN(plugin) { plugin.suite("register", marrow::conformance::register_suite()); }
