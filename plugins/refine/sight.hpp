// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <Eigen/Geometry>
#include <cmath>
#include <marrow/plugin.hpp>

#include "bone_in_view.hpp"

namespace marrow::refine {

/// Root mean square errors that are expected of a calibration.
struct ExpectedErrors {
  double turn_deg = 0.5;
  double shift_mm = 1;
  double focal_percent = 1;
  double centre_px = 5;
};

/// A camera's motion: rotations [deg] about the axes u, v and depth of its image, through `centre_mm`, and shifts [mm]
/// along them.
struct Sight {
  Eigen::Vector3d centre_mm;
  Eigen::Matrix3d axes;  ///< u, v and depth in columns, in the world
  Vector6d deviation;    ///< expected of the six numbers

  RigidTransform motion(const Vector6d& deg_and_mm) const {
    const Vector6d motion = from_units(deg_and_mm);
    RigidTransform moved{"world", "world"};
    moved.rotation = rotation_from_vector(axes * motion.head<3>());
    moved.translation_mm = centre_mm - moved.rotation * centre_mm + axes * motion.tail<3>();
    return moved;
  }
  /// How a bone's pose moves along its own axes, for small motions of the camera; both in degrees and mm.
  Matrix6d of_bone(const RigidTransform& world_from_model, const FragmentFrame& frame) const {
    const Eigen::Matrix3d to_bone = (world_from_model.rotation * frame.axes).transpose();
    const Eigen::Vector3d arm = world_from_model * frame.origin_mm - centre_mm;
    Matrix6d change = Matrix6d::Zero();
    change.topLeftCorner<3, 3>() = change.bottomRightCorner<3, 3>() = to_bone * axes;
    for (int i = 0; i < 3; ++i) change.block<3, 1>(3, i) = to_bone * axes.col(i).cross(arm) * radians(1);
    return change;
  }
};

/// What is expected of a view's camera, as motions about a point between the bones. Throws Error if that point does not
/// lie in front of the camera.
inline Sight sight_of(const View& view, const Eigen::Vector3d& centre_mm, const ExpectedErrors& expected) {
  const double depth_mm = (view.camera.camera_from_world * centre_mm).z();
  if (!(depth_mm > 0))
    throw Error("view '" + view.name + "': the bones do not lie in front of its camera; look at the overlays first");
  const double each = 1 / std::sqrt(3.0), each_of_two = 1 / std::sqrt(2.0);
  const Eigen::Vector2d centre =
      offset_at_mm(view.camera, centre_mm, Eigen::Vector2d::Constant(each_of_two * expected.centre_px));
  const double shift = each * expected.shift_mm, depth = expected.focal_percent / 100 * depth_mm,
               turn = each * expected.turn_deg;
  Sight sight{centre_mm, view.camera.camera_from_world.rotation.transpose(), Vector6d()};
  sight.deviation << turn, turn, turn, std::hypot(shift, centre.x()), std::hypot(shift, centre.y()),
      std::hypot(shift, depth);
  return sight;
}

}  // namespace marrow::refine
