// SPDX-License-Identifier: Apache-2.0
#include "marrow/initial/moved_outline.hpp"

namespace marrow::initial {

MovedOutline::MovedOutline(const OutlineProjector& projector, const Camera& camera, const EdgeScores& scores)
    : projector_(projector), camera_(camera), scores_(scores) {}

void MovedOutline::draw(const RigidTransform& world_from_model) {
  constexpr double kMargin_cells = 8;
  const int margin_px = int(kMargin_cells * scores_.cell_px());
  Camera wide = camera_;
  wide.intrinsics.topRightCorner<2, 1>().array() += margin_px;
  wide.width_px += 2 * margin_px, wide.height_px += 2 * margin_px;
  const RigidTransform camera_from_model = camera_.camera_from_world * world_from_model;
  points_.clear();
  for (const OutlinePoint& point : projector_.outline(wide, world_from_model, scores_.cell_px())) {
    const Eigen::Vector2d normal(point.normal_u, point.normal_v);
    const Eigen::Vector2d at_px(point.u_px - margin_px, point.v_px - margin_px);
    // The tangent plane of the surface contains the ray, so the tangent of the outline is its image.
    const Eigen::Vector3d tangent(normal.x(), normal.y(), -normal.dot(at_px));
    points_.push_back({(camera_from_model * point.model_mm.cast<double>().eval()).cast<float>(),
                       (camera_.intrinsics.transpose() * tangent).normalized().cast<float>()});
  }
}

int MovedOutline::score_after(const RigidTransform& world_from_world) const {
  const RigidTransform moved = camera_.camera_from_world * world_from_world * inverse(camera_.camera_from_world);
  const Eigen::Matrix3d& intrinsics = camera_.intrinsics;
  const Eigen::Matrix3f image = (intrinsics * moved.rotation).cast<float>(),
                        tangents = (intrinsics.inverse().transpose() * moved.rotation).cast<float>();
  const Eigen::Vector3f offset = (intrinsics * moved.translation_mm).cast<float>();
  const float width_px = float(camera_.width_px - 1), height_px = float(camera_.height_px - 1);
  int sum = 0;
  for (const SurfacePoint& point : points_) {
    const Eigen::Vector3f place = image * point.place_mm + offset;
    const float u_px = place.x() / place.z(), v_px = place.y() / place.z();
    if (!(place.z() > 0 && u_px >= 0 && v_px >= 0 && u_px <= width_px && v_px <= height_px)) continue;
    const Eigen::Vector2f normal = (tangents * point.normal).head<2>();
    sum += scores_.at(u_px, v_px, normal.x(), normal.y());
  }
  return sum;
}

}  // namespace marrow::initial
