// SPDX-License-Identifier: Apache-2.0
#include "workbench/value_json.hpp"

namespace marrow::workbench {

using nlohmann::json;

json json_of(const Eigen::Vector3d& vector) { return {vector.x(), vector.y(), vector.z()}; }

json json_of(const RigidTransform& target_from_source) {
  json rows = json::array();
  for (int i = 0; i < 3; ++i) {
    json row = json::array();
    for (int k = 0; k < 3; ++k) row.push_back(target_from_source.rotation(i, k));
    row.push_back(target_from_source.translation_mm[i]);
    rows.push_back(row);
  }
  rows.push_back({0, 0, 0, 1});
  return rows;
}

json json_of(const Camera& camera) {
  json intrinsics = json::array();
  for (int i = 0; i < 3; ++i)
    intrinsics.push_back({camera.intrinsics(i, 0), camera.intrinsics(i, 1), camera.intrinsics(i, 2)});
  return {{"intrinsics", intrinsics},
          {"camera_from_world", json_of(camera.camera_from_world)},
          {"width_px", camera.width_px},
          {"height_px", camera.height_px}};
}

std::vector<float> floats_of(const std::vector<Eigen::Vector3d>& points) {
  std::vector<float> numbers;
  numbers.reserve(3 * points.size());
  for (const Eigen::Vector3d& point : points)
    for (int k = 0; k < 3; ++k) numbers.push_back(float(point[k]));
  return numbers;
}

std::string bytes_of_pixels(const cv::Mat& pixels) {
  std::string bytes;
  bytes.reserve(pixels.total() * pixels.elemSize());
  for (int row = 0; row < pixels.rows; ++row)
    bytes.append(pixels.ptr<char>(row), std::size_t(pixels.cols) * pixels.elemSize());
  return bytes;
}

}  // namespace marrow::workbench
