// SPDX-License-Identifier: Apache-2.0
#pragma once
// Points of a known object and where they are seen (docs/case.md).
#include <Eigen/Core>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace marrow::files {

struct KnownPoint {
  std::string name;
  std::optional<Eigen::Vector3d> world_mm;         ///< none where only views tell
  std::map<std::string, Eigen::Vector2d> seen_px;  ///< by the name of the view
};

/// Throws Error.
std::vector<KnownPoint> read_points_file(const std::filesystem::path& path);

}  // namespace marrow::files
