// SPDX-License-Identifier: Apache-2.0
// Functions of the process that runs the pipeline, as a node written in Python has them among its inputs. Projectors
// draw there (marrow/runtime/plugins/asked_projectors.cpp).
#include <pybind11/stl.h>

#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>

#include "values.hpp"

namespace marrow::python {
namespace {

/// The other process. `ask` takes a question and, for an optimizer, a function that gives values; it returns the reply.
/// It may be called from any thread.
class Asked {
 public:
  Asked(py::object ask, std::uint64_t function)
      : ask_(std::make_shared<py::object>(std::move(ask))), function_(function) {}
  ~Asked() {
    const py::gil_scoped_acquire acquire;
    ask_.reset();
  }
  Asked(const Asked& other) : function_(other.function_), changes_(other.changes_) {
    const py::gil_scoped_acquire acquire;
    ask_ = other.ask_;
  }
  Asked& operator=(const Asked&) = delete;

  /// The same function at another level, or smoothed.
  Asked changed(std::vector<double> change) const {
    Asked made = *this;
    made.changes_.push_back(std::move(change));
    return made;
  }

  /// Fills the question in, asks, and lets `read` take the reply, all with Python's lock.
  void ask(const std::function<void(py::dict&)>& fill, const std::function<void(const py::object&)>& read,
           const py::object* own = nullptr) const {
    const py::gil_scoped_acquire acquire;
    py::dict question;
    question["function"] = function_;
    if (!changes_.empty()) question["changes"] = changes_;
    fill(question);
    read(own ? (*ask_)(question, *own) : (*ask_)(question));
  }

 private:
  std::shared_ptr<py::object> ask_;
  std::uint64_t function_;
  std::vector<std::vector<double>> changes_;
};

/// Transforms as 12 numbers each: the first three rows of the matrix.
py::list listed_transforms(const std::vector<RigidTransform>& transforms) {
  py::list numbers;
  for (const RigidTransform& one : transforms)
    for (int row = 0; row < 3; ++row) {
      for (int column = 0; column < 3; ++column) numbers.append(one.rotation(row, column));
      numbers.append(one.translation_mm[row]);
    }
  return numbers;
}

/// What every question about a projector has.
void put_view(py::dict& question, const char* what, const Camera& camera, const RigidTransform& world_from_model) {
  py::list intrinsics;
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 3; ++column) intrinsics.append(camera.intrinsics(row, column));
  py::dict seen_by;
  seen_by["width_px"] = camera.width_px;
  seen_by["height_px"] = camera.height_px;
  seen_by["intrinsics"] = intrinsics;
  seen_by["camera_from_world"] = listed_transforms({camera.camera_from_world});
  question["do"] = what;
  question["camera"] = seen_by;
  question["pose"] = listed_transforms({world_from_model});
}

/// Floating-point numbers whose bytes a reply has in base64.
std::vector<float> unpacked(const py::object& reply) {
  const std::string bytes = py::module_::import("base64").attr("b64decode")(reply).cast<std::string>();
  std::vector<float> numbers(bytes.size() / sizeof(float));
  std::memcpy(numbers.data(), bytes.data(), numbers.size() * sizeof(float));
  return numbers;
}

class AskedOutlineProjector : public OutlineProjector {
 public:
  explicit AskedOutlineProjector(Asked asked) : asked_(std::move(asked)) {}

  std::vector<OutlinePoint> outline(const Camera& camera, const RigidTransform& world_from_model,
                                    double spacing_px) const override {
    std::vector<float> numbers;
    asked_.ask(
        [&](py::dict& question) {
          put_view(question, "outline", camera, world_from_model);
          question["spacing_px"] = spacing_px;
        },
        [&](const py::object& reply) { numbers = unpacked(reply); });
    std::vector<OutlinePoint> points(numbers.size() / 7);
    for (std::size_t i = 0; i < points.size(); ++i) {
      const float* of_point = &numbers[7 * i];
      points[i] = {of_point[0], of_point[1], of_point[2], of_point[3], {of_point[4], of_point[5], of_point[6]}};
    }
    return points;
  }

 private:
  Asked asked_;
};

class AskedRadiographProjector : public RadiographProjector {
 public:
  explicit AskedRadiographProjector(Asked asked) : asked_(std::move(asked)) {}

  std::vector<float> radiograph(const Camera& camera, const RigidTransform& world_from_model,
                                const PixelGrid& grid) const override {
    return drawn("grid", camera, world_from_model, [&](py::dict& question) {
      question["grid"] = py::make_tuple(grid.u_px, grid.v_px, grid.step_px, grid.columns, grid.rows);
    });
  }
  std::vector<float> radiograph(const Camera& camera, const RigidTransform& world_from_model,
                                const std::vector<Eigen::Vector2f>& pixels) const override {
    return drawn("pixels", camera, world_from_model, [&](py::dict& question) {
      py::list numbers;
      for (const Eigen::Vector2f& pixel : pixels)
        for (const float number : pixel) numbers.append(number);
      question["pixels"] = numbers;
    });
  }
  PixelGrid region(const Camera& camera, const RigidTransform& world_from_model) const override {
    PixelGrid region;
    asked_.ask([&](py::dict& question) { put_view(question, "region", camera, world_from_model); },
               [&](const py::object& reply) {
                 const auto given = reply.cast<py::list>();
                 region = {given[0].cast<double>(), given[1].cast<double>(), given[2].cast<double>(),
                           given[3].cast<int>(), given[4].cast<int>()};
               });
    return region;
  }
  std::shared_ptr<const RadiographProjector> smoothed(double sigma_mm) const override {
    const Asked made = asked_.changed({sigma_mm});
    bool is_there = false;
    made.ask([](py::dict& question) { question["do"] = "is_there"; },
             [&](const py::object& reply) { is_there = reply.cast<bool>(); });
    return is_there ? std::make_shared<const AskedRadiographProjector>(made) : nullptr;
  }

 private:
  std::vector<float> drawn(const char* what, const Camera& camera, const RigidTransform& world_from_model,
                           const std::function<void(py::dict&)>& put_pixels) const {
    std::vector<float> values;
    asked_.ask(
        [&](py::dict& question) {
          put_view(question, what, camera, world_from_model);
          put_pixels(question);
        },
        [&](const py::object& reply) { values = unpacked(reply); });
    return values;
  }

  Asked asked_;
};

/// A projector of this type. Throws Error if the type is none of a projector.
Value asked_projector(const std::string& type, Asked asked) {
  if (type == TypeInfo::of<OutlineProjector>().id)
    return Value::of<OutlineProjector>(std::make_shared<const AskedOutlineProjector>(std::move(asked)));
  if (type == TypeInfo::of<RadiographProjector>().id)
    return Value::of<RadiographProjector>(std::make_shared<const AskedRadiographProjector>(std::move(asked)));
  throw Error("an input of type '" + type + "' cannot be asked");
}

// Functions among the inputs of a node written in Python. They stay in the process that runs the pipeline
// (marrow/runtime/plugins/asked_functions.hpp), which is asked for what they give.

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
