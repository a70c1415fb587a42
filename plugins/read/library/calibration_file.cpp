// SPDX-License-Identifier: Apache-2.0
#include "marrow/read/calibration_file.hpp"

#include "marrow/toolbox/files/yaml_values.hpp"

namespace marrow::read {

using files::YamlMap;

Calibration read_calibration_file(const std::filesystem::path& path) {
  files::YamlFile file(path);
  const YamlMap map(
      file, file.root(), "calibration",
      {"marrow-calibration", "width_px", "height_px", "intrinsics", "radial_distortion", "deviation", "residual_px"});
  check_version(map, "marrow-calibration");
  Calibration calibration;
  const auto width = map.integer("width_px"), height = map.integer("height_px");
  const auto intrinsics = map.matrix("intrinsics", 3, 3);
  const auto distortion = map.vector3("radial_distortion");
  if (map.has("residual_px")) calibration.residual_px = map.number("residual_px").value_or(0);
  if (map.has("deviation")) {
    const YamlMap deviation(file, map.node("deviation"), "deviation",
                            {"focal_px", "principal_px", "radial_distortion"});
    const auto pair = [&](const std::string& key) {
      const auto row = deviation.numbers(key, 2);
      return row ? Eigen::Vector2d((*row)[0], (*row)[1]) : Eigen::Vector2d(0, 0);
    };
    calibration.focal_deviation_px = pair("focal_px");
    calibration.principal_deviation_px = pair("principal_px");
    if (const auto terms = deviation.vector3("radial_distortion"))
      for (int i = 0; i < 3; ++i) calibration.distortion_deviation[std::size_t(i)] = (*terms)[i];
  }
  file.finish();
  calibration.width_px = *width;
  calibration.height_px = *height;
  calibration.intrinsics = *intrinsics;
  for (int i = 0; i < 3; ++i) calibration.distortion.k[std::size_t(i)] = (*distortion)[i];
  Camera camera{*width, *height, *intrinsics, {}};
  camera.camera_from_world = {"camera", "world", Eigen::Matrix3d::Identity(), Eigen::Vector3d::Zero()};
  check_camera(camera, path.string());
  check_distortion(*intrinsics, calibration.distortion, *width, *height, path.string());
  return calibration;
}

}  // namespace marrow::read
