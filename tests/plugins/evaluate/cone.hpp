// SPDX-License-Identifier: Apache-2.0
#pragma once
// Where a circular cone of known axis is seen, by the planes through the source that touch it.
#include "tests/plugins/initial/tube.hpp"

namespace marrow::test::cone {

/// The cone {X : the angle at `apex_mm` between X and the unit vector `direction` is `half_angle_rad`}.
struct Cone {
  Vector3d apex_mm, direction;
  double half_angle_rad;
  /// Diameter of the section across the axis through a point.
  double radius_mm(const Vector3d& point) const { return std::tan(half_angle_rad) * direction.dot(point - apex_mm); }
};

/// Exact borders between two heights of the image. A plane that touches the cone goes through its apex, and its unit
/// normal has the cosine -sin(half angle) with the axis.
inline ShaftLines borders(const Camera& camera, const Cone& cone, double from_v, double to_v) {
  const Vector3d to_apex = (cone.apex_mm - source_position_mm(camera)).normalized(),
                 along = (cone.direction - to_apex * to_apex.dot(cone.direction)).normalized(),
                 across = to_apex.cross(along);
  const double part = -std::sin(cone.half_angle_rad) / along.dot(cone.direction), rest = std::sqrt(1 - part * part);
  LineSegment segments[2];
  for (const int side : {0, 1}) {
    const Vector3d normal = part * along + (side ? -rest : rest) * across;
    const Vector3d line = camera.intrinsics.inverse().transpose() * (camera.camera_from_world.rotation * normal);
    segments[side] = {tube::at_height(line, from_v), tube::at_height(line, to_v)};
  }
  ShaftLines lines;
  const bool first_is_left = segments[0].from_px.x() > segments[1].from_px.x();  // they run down
  lines.left = segments[first_is_left ? 0 : 1], lines.right = segments[first_is_left ? 1 : 0];
  return lines;
}

}  // namespace marrow::test::cone
