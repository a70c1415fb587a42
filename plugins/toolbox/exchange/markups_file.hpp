// SPDX-License-Identifier: Apache-2.0
#pragma once
// The two formats of 3D Slicer's points, and what their readers share.
#include "marrow/toolbox/exchange/markups.hpp"

namespace marrow::exchange {

std::vector<MarkedPoint> read_markups_json(const std::filesystem::path& path);
std::vector<MarkedPoint> read_markups_fcsv(const std::filesystem::path& path);

/// The place in LPS of a point whose file gives it in LPS or RAS.
inline Eigen::Vector3d in_lps(const Eigen::Vector3d& at_mm, bool is_ras) {
  return is_ras ? Eigen::Vector3d(-at_mm.x(), -at_mm.y(), at_mm.z()) : at_mm;
}

constexpr std::uint64_t kMostMarkupsBytes = 64u << 20;
/// No coordinate of a patient is larger. A larger one is damaged, or in another unit.
constexpr double kLargestCoordinate_mm = 1e6;

}  // namespace marrow::exchange
