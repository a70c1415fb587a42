// SPDX-License-Identifier: Apache-2.0
#pragma once
// Values as the pages get them: JSON, and bytes of pixels and surfaces.
#include <nlohmann/json.hpp>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "marrow/domain/camera.hpp"

namespace marrow::workbench {

/// [x, y, z]
nlohmann::json json_of(const Eigen::Vector3d& vector);
/// A 4 x 4 matrix as rows.
nlohmann::json json_of(const RigidTransform& target_from_source);
/// {intrinsics, camera_from_world, width_px, height_px} with matrices as rows.
nlohmann::json json_of(const Camera& camera);

/// The coordinates of the points, one point after the other.
std::vector<float> floats_of(const std::vector<Eigen::Vector3d>& points);
/// The items as they are in memory.
template <class Item>
std::string bytes_of_items(const std::vector<Item>& items) {
  return {reinterpret_cast<const char*>(items.data()), items.size() * sizeof(Item)};
}
/// The pixels, row after row without gaps.
std::string bytes_of_pixels(const cv::Mat& pixels);

}  // namespace marrow::workbench
