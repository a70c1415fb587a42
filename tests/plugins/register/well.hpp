// SPDX-License-Identifier: Apache-2.0
#pragma once
// Costs that can be computed by hand: a bowl about a pose, with or without waves.

#include "tests/harness/node_test.hpp"

namespace marrow::test::well {

/// From the bottom: rotations [deg] and translations [mm] about a frame.
inline Vector6d way(const RigidTransform& bottom, const RigidTransform& pose, const FragmentFrame& frame) {
  Vector6d motion = motion_between(bottom, pose, frame);
  motion.head<3>() *= degrees(1);
  return motion;
}

/// The mean square of the six numbers of the way from the bottom, and on top of it waves of a height and a length.
class Well : public Cost {
 public:
  /// The levels that it was asked for, of all copies.
  struct Asked {
    std::mutex mutex;
    std::vector<CostLevel> levels;
  };
  Well(RigidTransform bottom, FragmentFrame frame, double height = 0, double length = 1)
      : bottom_(std::move(bottom)), frame_(std::move(frame)), height_(height), length_(length) {}

  double value(const RigidTransform& world_from_model) const override {
    const Vector6d motion = way(bottom_, world_from_model, frame_);
    double waves = 0;
    for (int k = 0; k < 6; ++k) waves += 0.5 * height_ * (1 - std::cos(2 * kPi * motion[k] / length_));
    return (motion.squaredNorm() + waves) / 6;
  }
  std::shared_ptr<const Cost> at_level(const CostLevel& level) const override {
    const std::lock_guard lock(asked->mutex);
    asked->levels.push_back(level);
    return std::make_shared<Well>(*this);
  }

  std::shared_ptr<Asked> asked = std::make_shared<Asked>();

 private:
  RigidTransform bottom_;
  FragmentFrame frame_;
  double height_, length_;
};

/// A pose that is no round number in any coordinate.
const FragmentFrame kFrame{Vector3d(5, -3, 80), rotation_from_vector({0.1, -0.2, 0.3}), true};
const RigidTransform kTruth = placed({12, -7, 30}, {0.2, 0.1, -0.4});
inline Pose truth() {
  Pose pose = pose_of(kTruth);
  pose.frame = kFrame;
  return pose;
}

/// A pose moved about its frame, in degrees and mm.
inline Pose pose_at(const Pose& from, const Vector6d& deg_and_mm) {
  Vector6d motion = deg_and_mm;
  motion.head<3>() *= radians(1);
  Pose pose = from;
  pose.world_from_model = marrow::moved(from.world_from_model, from.frame, motion);
  return pose;
}
inline Pose pose_at(const Pose& from, double rx, double ry, double rz, double tx, double ty, double tz) {
  return pose_at(from, Vector6d{rx, ry, rz, tx, ty, tz});
}
/// How far a pose is from another, in degrees and mm together.
inline double apart(const Pose& from, const Pose& to) {
  return way(from.world_from_model, to.world_from_model, from.frame).norm();
}

/// A cost with the simplest optimizer that follows it, and a start.
inline Inputs searched(const std::shared_ptr<const Cost>& cost, const Pose& start) {
  return {{"cost", Value::of<Cost>(cost)},
          {"optimizer", call("optimizer.nelder_mead", {}).at("optimizer")},
          {"start", item(start)}};
}

}  // namespace marrow::test::well

namespace well = marrow::test::well;
