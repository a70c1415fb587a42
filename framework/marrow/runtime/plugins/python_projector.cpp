// SPDX-License-Identifier: Apache-2.0
// Projectors written in Python: a process draws the pixels of a radiograph.
#include <algorithm>
#include <cmath>

#include "marrow/base/number_text.hpp"
#include "marrow/runtime/node/types.hpp"
#include "marrow/runtime/plugins/python_functions.hpp"

namespace marrow {
namespace {

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

std::shared_ptr<const RadiographProjector> python_projector(PythonFunction function, Context& context) {
  const auto numbers = function.make(context).at("corners_mm").get<std::vector<double>>();
  std::vector<Eigen::Vector3d> corners_mm;
  for (std::size_t i = 0; i + 2 < numbers.size(); i += 3)
    corners_mm.emplace_back(numbers[i], numbers[i + 1], numbers[i + 2]);
  return std::make_shared<const PythonProjector>(std::move(function), std::move(corners_mm));
}

}  // namespace marrow
