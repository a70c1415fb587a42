// SPDX-License-Identifier: Apache-2.0
#include "marrow/guide/servo.hpp"

#include <algorithm>

#include "marrow/domain/decompositions.hpp"

namespace marrow::guide {
namespace {

constexpr double kArm_mm = 100;

FragmentFrame frame_at(const Eigen::Vector3d& centre_mm) {
  FragmentFrame frame;
  frame.origin_mm = centre_mm;
  frame.axes.setIdentity();
  return frame;
}

}  // namespace

Vector6d limited_step(const Vector6d& error, const StepLimits& limits) {
  const Vector6d step = -limits.damping * error;
  const double share = std::max(
      {1.0, degrees(step.head<3>().norm()) / limits.max_rotation_deg, step.tail<3>().norm() / limits.max_shift_mm});
  return step / share;
}

RigidTransform motion_of(const Vector6d& step, const Eigen::Vector3d& centre_mm) {
  return moved({"reference", "reference"}, frame_at(centre_mm), step);
}

Vector6d step_of(const RigidTransform& motion, const Eigen::Vector3d& centre_mm) {
  return motion_between({motion.target, motion.source}, motion, frame_at(centre_mm));
}

RigidTransform told_for(const RigidTransform& seen, const RigidTransform& robot_from_reference) {
  return robot_from_reference * seen * inverse(robot_from_reference);
}

Vector6d in_mm(const Vector6d& motion) {
  Vector6d result = motion;
  result.head<3>() *= kArm_mm;
  return result;
}

Vector6d from_mm(const Vector6d& motion_mm) {
  Vector6d result = motion_mm;
  result.head<3>() /= kArm_mm;
  return result;
}

Matrix6d broyden(const Matrix6d& jacobian, const Vector6d& asked_mm, const Vector6d& seen_mm) {
  constexpr double kLeast_mm = 0.5;
  if (asked_mm.norm() < kLeast_mm) return jacobian;
  return jacobian + (seen_mm - jacobian * asked_mm) * asked_mm.transpose() / asked_mm.squaredNorm();
}

Vector6d ask_for(const Matrix6d& jacobian, const Vector6d& wanted_mm, double mu) {
  const Matrix6d squares = jacobian.transpose() * jacobian + mu * mu * Matrix6d::Identity();
  return solve_symmetric<6>(squares, Vector6d(jacobian.transpose() * wanted_mm));
}

}  // namespace marrow::guide
