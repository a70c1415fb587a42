// SPDX-License-Identifier: Apache-2.0
// Projectors that a node written in Python takes: what they give is handed over as the bytes of floating-point numbers.
#include <array>

#include "marrow/base/base64.hpp"
#include "marrow/base/error.hpp"
#include "marrow/runtime/plugins/asked_functions.hpp"

namespace marrow {
namespace {

using nlohmann::json;

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
