// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/field/bones_apart.hpp"

#include <algorithm>
#include <cmath>

namespace marrow::field {
namespace {

/// The signed distances of points that lie in the field's grid. Outside of it nothing is known but that the bone is
/// far away.
std::vector<double> distances_mm(const std::vector<Eigen::Vector3d>& points_mm, const SignedField& bone,
                                 const RigidTransform& bone_from_points) {
  const Eigen::Vector3d last = Eigen::Vector3i(bone.grid.size.data()).cast<double>().array() - 1;
  std::vector<double> distances;
  for (const Eigen::Vector3d& point : points_mm) {
    const Eigen::Vector3d index = bone.grid.index_from_point(bone_from_points * point);
    if ((index.array() >= 0).all() && (index.array() <= last.array()).all())
      distances.push_back(double(sample_trilinear(bone.grid, bone.values_mm, index)));
  }
  return distances;
}

}  // namespace

double penetration_mm(const std::vector<Eigen::Vector3d>& points_mm, const SignedField& bone,
                      const RigidTransform& bone_from_points) {
  double squares = 0, fourths = 0;
  for (const double distance : distances_mm(points_mm, bone, bone_from_points)) {
    if (!(distance < 0)) continue;
    squares += distance * distance;
    fourths += std::pow(distance, 4);
  }
  return squares > 0 ? std::sqrt(fourths / squares) : 0;
}

double gap_mm(const std::vector<Eigen::Vector3d>& points_mm, const SignedField& bone,
              const RigidTransform& bone_from_points) {
  constexpr double kFall_mm = 0.2;
  const std::vector<double> distances = distances_mm(points_mm, bone, bone_from_points);
  if (distances.empty()) return double(*std::max_element(bone.values_mm.begin(), bone.values_mm.end()));
  const double nearest = *std::min_element(distances.begin(), distances.end());
  double sum = 0, weights = 0;
  for (const double distance : distances) {
    const double weight = std::exp((nearest - distance) / kFall_mm);
    sum += weight * distance;
    weights += weight;
  }
  return sum / weights;
}

double deepest_mm(const std::vector<Eigen::Vector3d>& points_mm, const SignedField& bone,
                  const RigidTransform& bone_from_points) {
  double deepest = 0;
  for (const double distance : distances_mm(points_mm, bone, bone_from_points)) deepest = std::max(deepest, -distance);
  return deepest;
}

}  // namespace marrow::field
