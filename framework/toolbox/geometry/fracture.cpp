// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/geometry/fracture.hpp"

#include <algorithm>
#include <limits>
#include <vector>

#include "marrow/domain/error.hpp"

namespace marrow::geometry {

Eigen::Vector3d fracture_centre_mm(const Mesh& fragment, const Mesh& other) {
  constexpr std::size_t kSamples = 3000;
  constexpr double kFacing_mm = 3;
  if (fragment.triangles.empty() || other.triangles.empty())
    throw Error("the fracture is not found: a fragment's surface has no triangles");
  const std::vector<Eigen::Vector3d> points = sample_surface(fragment, kSamples);
  const std::vector<Eigen::Vector3d> others = sample_surface(other, kSamples);
  std::vector<double> distances_mm;
  for (const Eigen::Vector3d& point : points) {
    double least = std::numeric_limits<double>::infinity();
    for (const Eigen::Vector3d& one : others) least = std::min(least, (one - point).squaredNorm());
    distances_mm.push_back(std::sqrt(least));
  }
  const double facing_mm = *std::min_element(distances_mm.begin(), distances_mm.end()) + kFacing_mm;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  int count = 0;
  for (std::size_t i = 0; i < points.size(); ++i)
    if (distances_mm[i] <= facing_mm) sum += points[i], ++count;
  return sum / count;
}

}  // namespace marrow::geometry
