// SPDX-License-Identifier: Apache-2.0
#include "marrow/runtime/plugins/python_functions.hpp"

#include <cmath>

#include "marrow/base/number_text.hpp"

namespace marrow {

using nlohmann::json;

namespace {

/// A process makes the cost once, and gets the poses in batches. If the node takes other costs, it is a decorator: what
/// they say of a level, a block or a view that says nothing, it says too.
class PythonCost : public Cost {
 public:
  explicit PythonCost(PythonFunction function)
      : function_(std::move(function)), numbers_of_costs_(function_.functions().costs()) {}

  double value(const RigidTransform& world_from_model) const override { return values({world_from_model}).at(0); }
  std::vector<double> values(const std::vector<RigidTransform>& world_from_model) const override {
    if (world_from_model.empty()) return {};
    return costs_of({{"do", "cost"}, {"poses", poses_of(world_from_model)}}, world_from_model.size());
  }
  /// Without other costs it has one resolution only.
  std::shared_ptr<const Cost> at_level(const CostLevel& level) const override {
    return std::make_shared<PythonCost>(numbers_of_costs_.empty() ? function_ : function_.at_level(level));
  }
  /// The blocks of all costs that it takes, one after the other. Leaves out a block by giving the node the value that
  /// the cost has without it.
  std::vector<double> without_each_block(const RigidTransform& world_from_model) const override {
    std::vector<double> values;
    for (const std::uint64_t one : numbers_of_costs_) {
      const std::vector<double> inner = cost(one).without_each_block(world_from_model);
      if (inner.empty()) continue;
      const std::vector<double> own = costs_of(
          {{"do", "cost"}, {"poses", poses_of({world_from_model})}, {"input", one}, {"instead", inner}}, inner.size());
      values.insert(values.end(), own.begin(), own.end());
    }
    return values;
  }
  /// The images say nothing if all costs that it takes say so.
  std::string nothing_compared(const RigidTransform& world_from_model) const override {
    std::string first;
    for (const std::uint64_t one : numbers_of_costs_) {
      const std::string reason = cost(one).nothing_compared(world_from_model);
      if (reason.empty()) return "";
      if (first.empty()) first = reason;
    }
    return first;
  }
  std::vector<std::string> silent_views(const RigidTransform& world_from_model) const override {
    std::vector<std::string> all;
    for (const std::uint64_t one : numbers_of_costs_)
      for (std::string& text : cost(one).silent_views(world_from_model))
        if (std::find(all.begin(), all.end(), text) == all.end()) all.push_back(std::move(text));
    return all;
  }

 private:
  static json poses_of(const std::vector<RigidTransform>& world_from_model) {
    json poses = json::array();
    for (const RigidTransform& pose : world_from_model)
      for (const json& number : json_of_transform(pose)) poses.push_back(number);
    return poses;
  }
  std::vector<double> costs_of(json request, std::size_t count) const {
    auto values = function_.ask(std::move(request)).at("values").get<std::vector<double>>();
    if (values.size() == count) return values;
    throw Error(formatted("{} gave {} costs, expected {}", function_.name(), values.size(), count));
  }
  const Cost& cost(std::uint64_t number) const { return function_.functions().at(number).as<Cost>(); }

  PythonFunction function_;
  std::vector<std::uint64_t> numbers_of_costs_;
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

/// Puts all costs of a value at a level.
void put_at_level(Value& value, const CostLevel& level) {
  for (Value& item : value.items) put_at_level(item, level);
  if (value.is_list() || value.is_absent() || !(value.type == TypeInfo::of<Cost>())) return;
  const Digest key = hash_of(value.key, level.contour_spacing_px, level.reach_px, level.pixel_step);
  value = Value::of<Cost>(value.as<Cost>().at_level(level));
  value.key = key;
}

using nlohmann::json;

json json_of_camera(const Camera& camera) {
  json intrinsics = json::array();
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 3; ++column) intrinsics.push_back(camera.intrinsics(row, column));
  return {{"width_px", camera.width_px},
          {"height_px", camera.height_px},
          {"intrinsics", intrinsics},
          {"camera_from_world", json_of_transform(camera.camera_from_world)}};
}

bool is_within(const PixelGrid& region, const Eigen::Vector2d& pixel) {
  return pixel.x() >= region.u_px && pixel.y() >= region.v_px && pixel.x() < region.u_px + region.columns &&
         pixel.y() < region.v_px + region.rows;
}

class PythonProjector : public RadiographProjector {
 public:
  PythonProjector(PythonFunction function, std::vector<Eigen::Vector3d> corners_mm)
      : function_(std::move(function)), corners_mm_(std::move(corners_mm)) {}

  std::vector<float> radiograph(const Camera& camera, const RigidTransform& world_from_model,
                                const PixelGrid& grid) const override {
    std::vector<Eigen::Vector2d> pixels;
    for (int row = 0; row < grid.rows; ++row)
      for (int column = 0; column < grid.columns; ++column) pixels.push_back(grid.pixel(column, row));
    return drawn(camera, world_from_model, pixels,
                 {{"grid", {grid.u_px, grid.v_px, grid.step_px}}, {"columns", grid.columns}, {"rows", grid.rows}});
  }

  std::vector<float> radiograph(const Camera& camera, const RigidTransform& world_from_model,
                                const std::vector<Eigen::Vector2f>& single) const override {
    std::vector<Eigen::Vector2d> pixels;
    json numbers = json::array();
    for (const Eigen::Vector2f& pixel : single) {
      pixels.push_back(pixel.cast<double>());
      numbers.push_back(pixel.x());
      numbers.push_back(pixel.y());
    }
    return drawn(camera, world_from_model, pixels, {{"pixels", numbers}});
  }

  /// The rectangle about the corners. The whole image if one of them is behind the source, but not all.
  PixelGrid region(const Camera& camera, const RigidTransform& world_from_model) const override {
    Eigen::Array2d least = Eigen::Array2d::Constant(1e9), most = -least;
    std::size_t behind = 0;
    for (const Eigen::Vector3d& corner : corners_mm_) {
      const Eigen::Vector3d seen = camera.intrinsics * (camera.camera_from_world * (world_from_model * corner));
      if (seen.z() <= kNearest_mm) {
        ++behind;
        continue;
      }
      least = least.min(seen.head<2>().array() / seen.z());
      most = most.max(seen.head<2>().array() / seen.z());
    }
    if (behind == corners_mm_.size()) return {};
    if (behind > 0) return {0, 0, 1, camera.width_px, camera.height_px};
    const Eigen::Array2d first = least.floor().max(0),
                         last = most.ceil().min(Eigen::Array2d(camera.width_px - 1, camera.height_px - 1));
    if ((last < first).any()) return {};
    return {first.x(), first.y(), 1, int(last.x() - first.x()) + 1, int(last.y() - first.y()) + 1};
  }

 private:
  static constexpr double kNearest_mm = 1;

  /// The values of the pixels that the request describes; 0 outside of the region.
  std::vector<float> drawn(const Camera& camera, const RigidTransform& world_from_model,
                           const std::vector<Eigen::Vector2d>& pixels, json request) const {
    std::vector<float> values(pixels.size());
    const PixelGrid seen = region(camera, world_from_model);
    const auto is_seen = [&](const Eigen::Vector2d& pixel) { return is_within(seen, pixel); };
    if (std::none_of(pixels.begin(), pixels.end(), is_seen)) return values;
    request["do"] = "radiograph";
    request["camera"] = json_of_camera(camera);
    request["pose"] = json_of_transform(world_from_model);
    std::vector<Value> outputs;
    function_.ask(std::move(request), &outputs);
    if (outputs.size() != 1 || !(outputs[0].type == TypeInfo::of<Image>()) || outputs[0].is_absent())
      throw Error(function_.name() + " gave no radiograph");
    const cv::Mat& made = outputs[0].as<Image>().pixels;
    if (made.type() != CV_32F || made.total() != pixels.size() || !made.isContinuous())
      throw Error(formatted("{} gave {} values for {} pixels", function_.name(), made.total(), pixels.size()));
    for (std::size_t i = 0; i < pixels.size(); ++i)
      if (is_seen(pixels[i])) values[i] = made.ptr<float>()[i];
    return values;
  }

  PythonFunction function_;
  std::vector<Eigen::Vector3d> corners_mm_;
};

}  // namespace

PythonFunction::PythonFunction(std::shared_ptr<PythonNodes> nodes, NodeInfo node, std::vector<Value> inputs,
                               const std::vector<OptionValue>& options)
    : nodes_(std::move(nodes)),
      node_(std::move(node)),
      inputs_(std::move(inputs)),
      options_(options),
      arguments_(inputs_, options) {
  static std::atomic<std::uint64_t> made{0};
  number_ = ++made;
}

PythonFunction PythonFunction::at_level(const CostLevel& level) const {
  std::vector<Value> inputs = inputs_;
  for (Value& input : inputs) put_at_level(input, level);
  PythonFunction made(nodes_, node_, std::move(inputs), options_);
  made.origin_ = std::make_shared<const PythonFunction>(*this);
  return made;
}

json PythonFunction::make(Context& context) const {
  return nodes_->ask(node_, {{"do", "make"}, {"function", number_}}, arguments_, context, nullptr);
}

json PythonFunction::ask(json request, std::vector<Value>* outputs, const PythonNodes::Reply& reply) const {
  Context context;
  request["function"] = number_;
  return nodes_->ask(node_, std::move(request), arguments_, context, outputs, reply);
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

std::shared_ptr<const RadiographProjector> python_projector(PythonFunction function, Context& context) {
  const auto numbers = function.make(context).at("corners_mm").get<std::vector<double>>();
  std::vector<Eigen::Vector3d> corners_mm;
  for (std::size_t i = 0; i + 2 < numbers.size(); i += 3)
    corners_mm.emplace_back(numbers[i], numbers[i + 1], numbers[i + 2]);
  return std::make_shared<const PythonProjector>(std::move(function), std::move(corners_mm));
}

}  // namespace marrow
