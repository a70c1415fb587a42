// SPDX-License-Identifier: Apache-2.0
// Functions that nodes make, as things that Python can call. All of them run without Python's lock.

#include <pybind11/stl.h>

#include <algorithm>
#include <cmath>

#include "marrow/base/number_text.hpp"
#include "pipelines.hpp"
#include "values.hpp"

namespace marrow::python {
namespace {

constexpr std::size_t kPosesAtOnce = 16;  // between two looks for Ctrl-C

struct CostValue : OtherValue {};
struct OptimizerValue : OtherValue {};
struct OutlineProjectorValue : OtherValue {};
struct RadiographProjectorValue : OtherValue {};

/// A marrow.Pose, or a matrix from the CT to the world.
RigidTransform pose_of(const py::handle& object, const std::string& what) {
  if (py::isinstance<Pose>(object)) return object.cast<const Pose&>().world_from_model;
  return transform_of(object, "world", "ct", what);
}

bool is_mapping(const py::handle& object) { return py::hasattr(object, "values") && py::hasattr(object, "keys"); }

/// Whether it is a pose or a matrix, and not an array or list of them.
bool is_one_pose(const py::handle& object) {
  if (py::isinstance<Pose>(object)) return true;
  if (is_mapping(object)) return false;
  const auto axes = [](const py::handle& array) {
    return py::module_::import("numpy").attr("ndim")(array).cast<int>();
  };
  if (!py::isinstance<py::list>(object) && !py::isinstance<py::tuple>(object)) return axes(object) == 2;
  if (py::len(object) == 0) return false;
  const py::object first = object[py::int_(0)];
  return !py::isinstance<Pose>(first) && axes(first) == 1;
}

std::vector<RigidTransform> poses_of(const py::object& object) {
  std::vector<RigidTransform> poses;
  for (const py::handle& one : is_mapping(object) ? object.attr("values")() : object)
    poses.push_back(pose_of(one, formatted("pose {}", poses.size() + 1)));
  return poses;
}

std::vector<double> values_of(const Cost& cost, const std::vector<RigidTransform>& poses) {
  std::atomic<bool> cancelled{false};
  std::vector<double> values;
  do_interruptibly(cancelled, [&] {
    for (std::size_t first = 0; first < poses.size() && !cancelled; first += kPosesAtOnce) {
      const auto begin = poses.begin() + std::ptrdiff_t(first),
                 end = begin + std::ptrdiff_t(std::min(kPosesAtOnce, poses.size() - first));
      for (const double value : cost.values({begin, end})) values.push_back(value);
    }
  });
  return values;
}

py::object call_cost(const CostValue& self, const py::object& poses) {
  const Cost& cost = self.value.as<Cost>();
  if (is_one_pose(poses)) return py::float_(values_of(cost, {pose_of(poses, "pose")}).at(0));
  const auto values = std::make_shared<const std::vector<double>>(values_of(cost, poses_of(poses)));
  return array_of(values, buffer_of(values->data(), {py::ssize_t(values->size())}));
}

const Camera& camera_of(const py::handle& object) {
  if (py::isinstance<View>(object)) return object.cast<const View&>().camera;
  if (py::isinstance<Camera>(object)) return object.cast<const Camera&>();
  throw Error("camera: expected a marrow.Camera or a marrow.View");
}

double positive(const char* name, double value) {
  if (std::isfinite(value) && value > 0) return value;
  throw Error(std::string(name) + ": expected a positive number, got " +
              py::str(py::float_(value)).cast<std::string>());
}

/// The values of single pixels.
py::object radiograph_at(const RadiographProjector& projector, const Camera& camera, const RigidTransform& pose,
                         const py::object& given) {
  const std::vector<double> numbers = numbers_of(given, {-1, 2}, "pixels");
  std::vector<Eigen::Vector2f> pixels;
  for (std::size_t i = 0; i < numbers.size(); i += 2) pixels.emplace_back(float(numbers[i]), float(numbers[i + 1]));
  std::atomic<bool> cancelled{false};
  auto values = std::make_shared<std::vector<float>>();
  do_interruptibly(cancelled, [&] { *values = projector.radiograph(camera, pose, pixels); });
  return array_of(values, buffer_of(values->data(), {py::ssize_t(values->size())}));
}

py::object call_radiograph(const RadiographProjectorValue& self, const py::object& camera, const py::object& pose,
                           double step_px, const py::object& pixels) {
  const Camera seen_by = camera_of(camera);
  const RigidTransform at = pose_of(pose, "pose");
  if (!pixels.is_none()) return radiograph_at(self.value.as<RadiographProjector>(), seen_by, at, pixels);
  positive("step_px", step_px);
  const auto count = [&](int pixels) { return int(std::ceil(pixels / step_px)); };
  const PixelGrid grid{0, 0, step_px, count(seen_by.width_px), count(seen_by.height_px)};
  std::atomic<bool> cancelled{false};
  auto values = std::make_shared<std::vector<float>>();
  do_interruptibly(cancelled, [&] { *values = self.value.as<RadiographProjector>().radiograph(seen_by, at, grid); });
  return array_of(values, buffer_of(values->data(), {grid.rows, grid.columns}));
}

py::object call_outline(const OutlineProjectorValue& self, const py::object& camera, const py::object& pose,
                        double spacing_px) {
  const Camera seen_by = camera_of(camera);
  const RigidTransform at = pose_of(pose, "pose");
  positive("spacing_px", spacing_px);
  std::atomic<bool> cancelled{false};
  std::vector<OutlinePoint> points;
  do_interruptibly(cancelled, [&] { points = self.value.as<OutlineProjector>().outline(seen_by, at, spacing_px); });
  Eigen::MatrixXd rows(Eigen::Index(points.size()), 7);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const OutlinePoint& p = points[i];
    rows.row(Eigen::Index(i)) << double(p.u_px), double(p.v_px), double(p.normal_u), double(p.normal_v),
        p.model_mm.cast<double>().transpose();
  }
  return array_of(rows);
}

Eigen::VectorXd vector_of(const py::object& object, const std::string& what) {
  if (object.is_none()) return {};
  const std::vector<double> numbers = numbers_of(object, {-1}, what);
  return Eigen::Map<const Eigen::VectorXd>(numbers.data(), Eigen::Index(numbers.size()));
}

py::object array_of_point(const Eigen::VectorXd& x) { return array_of(Eigen::MatrixXd(x)).attr("ravel")(); }

/// Calls a Python function from another thread. What it raises ends the minimisation.
class AskedFunction {
 public:
  AskedFunction(py::object function, std::atomic<bool>& cancelled)
      : function_(std::move(function)), cancelled_(cancelled) {}
  double operator()(const Eigen::VectorXd& x) {
    if (cancelled_) throw Cancelled();
    const py::gil_scoped_acquire acquire;
    try {
      const double value = PyFloat_AsDouble(py::object(function_(array_of_point(x))).ptr());
      if (PyErr_Occurred()) throw py::error_already_set();
      return value;
    } catch (py::error_already_set& error) {
      fault_.emplace(std::move(error));
    }
    throw Cancelled();
  }
  void rethrow() {
    if (fault_) throw py::error_already_set(*fault_);
  }

 private:
  py::object function_;
  std::atomic<bool>& cancelled_;
  std::optional<py::error_already_set> fault_;
};

/// What was given; otherwise what the function has, if it is a marrow.Problem.
py::object or_of_problem(const py::object& given, const py::object& function, const char* name) {
  if (!given.is_none()) return given;
  const py::object problem = py::module_::import("marrow.problem").attr("Problem");
  return py::isinstance(function, problem) ? py::object(function.attr(name)) : py::none();
}

MinimisationResult minimise(const OptimizerValue& self, const py::object& function, const py::object& start,
                            const py::object& initial_step, const py::object& lower, const py::object& upper,
                            const py::object& max_evaluations, const py::object& step_tolerance) {
  std::atomic<bool> cancelled{false};
  AskedFunction asked(function, cancelled);
  MinimisationProblem problem;
  problem.function = [&](const Eigen::VectorXd& x) { return asked(x); };
  problem.start = vector_of(or_of_problem(start, function, "start"), "start");
  problem.initial_step = vector_of(or_of_problem(initial_step, function, "initial_step"), "initial_step");
  problem.lower = vector_of(or_of_problem(lower, function, "lower"), "lower");
  problem.upper = vector_of(or_of_problem(upper, function, "upper"), "upper");
  const py::object most = or_of_problem(max_evaluations, function, "left"),
                   tolerance = or_of_problem(step_tolerance, function, "step_tolerance");
  if (!most.is_none()) problem.max_evaluations = most.cast<int>();
  if (!tolerance.is_none()) problem.step_tolerance = tolerance.cast<double>();
  MinimisationResult result;
  try {
    do_interruptibly(cancelled, [&] { result = self.value.as<Optimizer>().minimise(problem); });
  } catch (...) {  // Cancelled, or what another process made of it
    asked.rethrow();
    throw;
  }
  return result;
}

template <class Function, class Kept>
py::class_<Kept, OtherValue> function_class(py::module_& module, const char* name, const char* help) {
  function_classes().push_back({TypeInfo::of<Function>(), [](const Value& value) { return py::cast(Kept{{value}}); }});
  py::class_<Kept, OtherValue> made(module, name, help);
  made.attr("type") = TypeInfo::of<Function>().id;
  return made;
}

void bind_optimizer(py::module_& module) {
  py::class_<MinimisationResult>(module, "Minimum", "The best point that an optimizer found.")
      .def_property_readonly(
          "x", [](const MinimisationResult& self) { return array_of_point(self.x); }, "The point.")
      .def_readonly("value", &MinimisationResult::value, "The function's value there.")
      .def_readonly("evaluations", &MinimisationResult::evaluations, "How often the function was asked.")
      .def_readonly("stopped_because", &MinimisationResult::stopped_because, "Why it ended, in words.")
      .def("__repr__", [](const MinimisationResult& self) {
        return formatted("<marrow.Minimum {} after {} evaluations>",
                         py::repr(py::float_(self.value)).cast<std::string>(), self.evaluations);
      });
  function_class<Optimizer, OptimizerValue>(module, "Optimizer", "Minimises a function of n variables.")
      .def("minimise", &minimise, py::arg("function"), py::arg("start") = py::none(),
           py::arg("initial_step") = py::none(), py::kw_only(), py::arg("lower") = py::none(),
           py::arg("upper") = py::none(), py::arg("max_evaluations") = py::none(),
           py::arg("step_tolerance") = py::none(),
           "Looks for the least value of function(x), where x is an array of n numbers. initial_step: one positive "
           "number for each of them. lower, upper: bounds for all of them, or None. It ends when steps are below "
           "step_tolerance (1e-4) times initial_step, or after max_evaluations (1000). A marrow.Problem has all of "
           "these itself; what is given besides it replaces them. What the function raises is raised.");
}

}  // namespace

void bind_functions(py::module_& module) {
  function_class<Cost, CostValue>(module, "Cost", "How badly a pose explains the images; smaller is better.")
      .def("__call__", &call_cost, py::arg("poses"),
           "The costs of an array of poses [N, 4, 4], or of a list or dictionary of poses: an array [N]. One "
           "marrow.Pose "
           "or 4 x 4 matrix gives one number. Matrices map points of the model, in mm, to the world.");
  function_class<RadiographProjector, RadiographProjectorValue>(module, "RadiographProjector",
                                                                "Draws radiographs of a model.")
      .def("__call__", &call_radiograph, py::arg("camera"), py::arg("pose"), py::kw_only(), py::arg("step_px") = 1.0,
           py::arg("pixels") = py::none(),
           "What a camera, or the camera of a view, would see of the model in a pose: line integrals in mm of water, "
           "as a read-only array [row, column] with every step_px-th pixel. With pixels [N, 2] (u, v): only at these, "
           "an array [N].");
  function_class<OutlineProjector, OutlineProjectorValue>(module, "OutlineProjector", "Draws the outline of a model.")
      .def("__call__", &call_outline, py::arg("camera"), py::arg("pose"), py::kw_only(), py::arg("spacing_px") = 1.0,
           "The outline of the model in a pose as a camera, or the camera of a view, would see it: an array [point, 7] "
           "with u, v, the normal's u and v, and the point of the surface in the frame of the model, in mm.");
  bind_optimizer(module);
}

}  // namespace marrow::python
