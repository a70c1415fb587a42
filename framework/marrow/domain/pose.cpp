// SPDX-License-Identifier: Apache-2.0
#include "marrow/domain/pose.hpp"

#include <cmath>
#include <utility>

#include "marrow/base/error.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/domain/decompositions.hpp"

namespace marrow {
namespace {

constexpr double kRounding = 1e-9;

/// The correlations: the covariance in units of its own deviations, so that radians and mm can be compared. A row whose
/// variance is 0 stays as it is.
Matrix6d correlations(const Matrix6d& covariance) {
  const Vector6d deviation = covariance.diagonal().cwiseSqrt();
  const Vector6d scale = (deviation.array() > 0).select(deviation.cwiseInverse(), Vector6d::Ones());
  return scale.asDiagonal() * covariance * scale.asDiagonal();
}

}  // namespace

void check_covariance(const Matrix6d& covariance, const std::string& what) {
  constexpr const char* kRemedy = "; a covariance is symmetric and has no negative eigenvalue";
  const auto place = [](Eigen::Index row, Eigen::Index column) {
    return formatted("row {}, column {}", row + 1, column + 1);
  };
  for (Eigen::Index i = 0; i < 6; ++i)
    if (covariance(i, i) < 0)
      throw Error(formatted("{}: the covariance has the negative variance {:g} in {}{}", what, covariance(i, i),
                            place(i, i), kRemedy));
  if (!covariance.allFinite()) return;
  const Matrix6d scaled = correlations(covariance);
  Eigen::Index row = 0, column = 0;
  if (const double apart = (scaled - scaled.transpose()).cwiseAbs().maxCoeff(&row, &column); apart > kRounding) {
    if (row > column) std::swap(row, column);
    throw Error(formatted("{}: the covariance is not symmetric: {:g} in {}, but {:g} in {}{}", what,
                          covariance(row, column), place(row, column), covariance(column, row), place(column, row),
                          kRemedy));
  }
  const double least = eigen_of_symmetric<6>(0.5 * (scaled + scaled.transpose())).values[0];
  if (least < -kRounding)
    throw Error(
        formatted("{}: the covariance has a negative eigenvalue ({:g} times its variances){}", what, least, kRemedy));
}

void check_pose(const Pose& pose, const std::string& what) {
  check_rigid(pose.world_from_model, what);
  check_rigid({"model", "fragment", pose.frame.axes, pose.frame.origin_mm}, what + ": the axes of its fragment");
  if (pose.covariance) check_covariance(*pose.covariance, what);
}

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
