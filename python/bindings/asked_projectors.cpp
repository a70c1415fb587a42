// SPDX-License-Identifier: Apache-2.0
// Projectors among the inputs of a node written in Python. They draw in the process that runs the pipeline
// (marrow/runtime/plugins/asked_projectors.cpp).
#include <cstring>

#include "asked.hpp"
#include "marrow/base/error.hpp"
#include "marrow/domain/functions.hpp"

namespace marrow::python {
namespace {

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

}  // namespace

Value asked_projector(const std::string& type, Asked asked) {
  if (type == TypeInfo::of<OutlineProjector>().id)
    return Value::of<OutlineProjector>(std::make_shared<const AskedOutlineProjector>(std::move(asked)));
  if (type == TypeInfo::of<RadiographProjector>().id)
    return Value::of<RadiographProjector>(std::make_shared<const AskedRadiographProjector>(std::move(asked)));
  throw Error("an input of type '" + type + "' cannot be asked");
}

}  // namespace marrow::python
