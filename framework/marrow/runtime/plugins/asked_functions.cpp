// SPDX-License-Identifier: Apache-2.0
#include "marrow/runtime/plugins/asked_functions.hpp"

#include <atomic>
#include <cmath>

#include "marrow/base/number_text.hpp"
#include "marrow/base/plain_text.hpp"

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

std::shared_ptr<const void> changed(const Cost& cost, const json& level) {
  return cost.at_level({level.at(0), level.at(1), level.at(2)});
}
std::shared_ptr<const void> changed(const RadiographProjector& projector, const json& sigma_mm) {
  return projector.smoothed(sigma_mm.at(0));
}

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

std::string packed(const std::vector<float>& numbers) {
  return base64({reinterpret_cast<const char*>(numbers.data()), numbers.size() * sizeof(float)});
}

Camera camera_of(const json& made) {
  Camera camera;
  camera.width_px = made.at("width_px");
  camera.height_px = made.at("height_px");
  const auto intrinsics = made.at("intrinsics").get<std::array<double, 9>>();
  camera.intrinsics = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(intrinsics.data());
  camera.camera_from_world = transforms_of(made.at("camera_from_world")).at(0);
  camera.camera_from_world.target = "camera";
  camera.camera_from_world.source = "world";
  return camera;
}

}  // namespace

json AskedFunctions::add(const Value& function) {
  static std::atomic<std::uint64_t> last{0};
  const std::uint64_t number = ++last;
  functions_[number] = function;
  return {{"function", number}, {"type", function.type.id}, {"key", function.key.hex()}};
}

const Value& AskedFunctions::at(std::uint64_t number) const {
  if (const auto found = functions_.find(number); found != functions_.end()) return found->second;
  throw Error("it used a function that an earlier call was given; use only the inputs of the call");
}

std::vector<std::uint64_t> AskedFunctions::costs() const {
  std::vector<std::uint64_t> numbers;
  for (const auto& [number, function] : functions_)
    if (function.type == TypeInfo::of<Cost>()) numbers.push_back(number);
  return numbers;
}

template <class Function>
const Function* AskedFunctions::asked(const json& question) const {
  const Function* one = &at(question.at("function")).as<Function>();
  std::string name = question["function"].dump();
  const std::scoped_lock lock(mutex_);
  for (const json& change : question.value("changes", json::array())) {
    name += change.dump();
    if (!changed_.contains(name)) changed_[name] = changed(*one, change);
    one = static_cast<const Function*>(changed_[name].get());
    if (!one) break;
  }
  return one;
}

json AskedFunctions::reply(const json& question, const AskProcess& ask_process) const {
  const Value& function = at(question.at("function"));
  if (function.type == TypeInfo::of<Optimizer>()) return minimised(function.as<Optimizer>(), question, ask_process);
  if (function.type == TypeInfo::of<OutlineProjector>()) return asked_of(function.as<OutlineProjector>(), question);
  if (function.type == TypeInfo::of<RadiographProjector>()) {
    const auto* projector = asked<RadiographProjector>(question);
    return question.at("do") == "is_there" ? json(projector != nullptr) : asked_of(*projector, question);
  }
  const auto* cost = asked<Cost>(question);
  if (!cost) throw Error("a cost has none at another level");
  return asked_of_cost(*cost, question);
}

bool can_be_asked(const TypeInfo& type) {
  return type == TypeInfo::of<Cost>() || type == TypeInfo::of<Optimizer>() ||
         type == TypeInfo::of<OutlineProjector>() || type == TypeInfo::of<RadiographProjector>();
}

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

// Projectors that a node written in Python takes: what they give is handed over as the bytes of floating-point numbers.

json asked_of(const OutlineProjector& projector, const json& question) {
  std::vector<float> numbers;
  for (const OutlinePoint& point : projector.outline(
           camera_of(question.at("camera")), transforms_of(question.at("pose")).at(0), question.at("spacing_px")))
    for (const float number : {point.u_px, point.v_px, point.normal_u, point.normal_v, point.model_mm.x(),
                               point.model_mm.y(), point.model_mm.z()})
      numbers.push_back(number);
  return packed(numbers);
}

json asked_of(const RadiographProjector& projector, const json& question) {
  const Camera camera = camera_of(question.at("camera"));
  const RigidTransform pose = transforms_of(question.at("pose")).at(0);
  const std::string what = question.at("do");
  if (what == "region") {
    const PixelGrid region = projector.region(camera, pose);
    return {region.u_px, region.v_px, region.step_px, region.columns, region.rows};
  }
  if (what == "grid") {
    const json& grid = question.at("grid");
    return packed(
        projector.radiograph(camera, pose, PixelGrid{grid.at(0), grid.at(1), grid.at(2), grid.at(3), grid.at(4)}));
  }
  const auto numbers = question.at("pixels").get<std::vector<float>>();
  std::vector<Eigen::Vector2f> pixels;
  for (std::size_t i = 0; i + 1 < numbers.size(); i += 2) pixels.emplace_back(numbers[i], numbers[i + 1]);
  return packed(projector.radiograph(camera, pose, pixels));
}

}  // namespace marrow
