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

}  // namespace marrow
