// SPDX-License-Identifier: Apache-2.0
#include "marrow/domain/central_rays.hpp"

#include "marrow/domain/decompositions.hpp"

namespace marrow {

std::optional<Eigen::Vector3d> meeting_point_mm(const List<View>& views) {
  constexpr double kLeastParallax = 1e-3;  // for two rays, twice the squared sine of half their angle
  Eigen::Matrix3d across = Eigen::Matrix3d::Zero();
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const View& view : views) {
    const Eigen::Vector3d ray = view.camera.camera_from_world.rotation.row(2).transpose();
    const Eigen::Matrix3d off = Eigen::Matrix3d::Identity() - ray * ray.transpose();
    across += off;
    sum += off * source_position_mm(view.camera);
  }
  if (views.empty() || eigen_of_symmetric(across).values[0] < kLeastParallax) return std::nullopt;
  const Eigen::Vector3d point = solve_symmetric(across, sum);
  for (const View& view : views)
    if (!((view.camera.camera_from_world * point).z() > 0)) return std::nullopt;
  return point;
}

}  // namespace marrow
