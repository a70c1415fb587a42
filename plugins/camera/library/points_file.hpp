// SPDX-License-Identifier: Apache-2.0
#pragma once
// Known points and their positions in the views (docs/case.md).
#include <Eigen/Core>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace marrow::files {

struct KnownPoint {
  std::string name;                                ///< its number in the file, from 1, if the file gives no name
  std::optional<Eigen::Vector3d> world_mm;         ///< absent if only the views determine it (at least two then)
  std::map<std::string, Eigen::Vector2d> seen_px;  ///< by the name of the view
};

/// Throws Error if the file cannot be read, or for missing or wrong values.
std::vector<KnownPoint> read_points_file(const std::filesystem::path& path);

}  // namespace marrow::files
