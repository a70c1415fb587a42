// SPDX-License-Identifier: Apache-2.0
#include "marrow/domain/pose.hpp"

namespace marrow {

RigidTransform moved(const RigidTransform& world_from_model, const FragmentFrame& frame, const Vector6d& motion) {
  const Eigen::Matrix3d turn = rotation_from_vector(frame.axes * motion.head<3>());
  const Eigen::Vector3d shift = frame.origin_mm - turn * frame.origin_mm + frame.axes * motion.tail<3>();
  return {world_from_model.target, world_from_model.source, world_from_model.rotation * turn,
          world_from_model.rotation * shift + world_from_model.translation_mm};
}

Vector6d motion_between(const RigidTransform& from, const RigidTransform& to, const FragmentFrame& frame) {
  const RigidTransform model_from_model = inverse(from) * to;
  Vector6d motion;
  motion.head<3>() = frame.axes.transpose() * vector_from_rotation(model_from_model.rotation);
  motion.tail<3>() = frame.axes.transpose() * (model_from_model * frame.origin_mm - frame.origin_mm);
  return motion;
}

Matrix6d change_of_frame(const FragmentFrame& from, const FragmentFrame& to) {
  const Eigen::Vector3d arm = to.origin_mm - from.origin_mm;
  Matrix6d change = Matrix6d::Zero();
  change.topLeftCorner<3, 3>() = change.bottomRightCorner<3, 3>() = to.axes.transpose() * from.axes;
  for (int i = 0; i < 3; ++i) change.block<3, 1>(3, i) = to.axes.transpose() * from.axes.col(i).cross(arm);
  return change;
}

Pose in_frame(Pose pose, const FragmentFrame& frame) {
  if (pose.covariance) {
    const Matrix6d change = change_of_frame(pose.frame, frame);
    pose.covariance = change * *pose.covariance * change.transpose();
  }
  pose.frame = frame;
  return pose;
}

}  // namespace marrow
