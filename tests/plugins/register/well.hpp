// SPDX-License-Identifier: Apache-2.0
#pragma once
// Costs that can be computed by hand: a bowl about a pose, with or without waves.
#include <cmath>
#include <marrow/domain/case.hpp>
#include <marrow/domain/functions.hpp>
#include <memory>
#include <mutex>
#include <vector>

namespace well {

/// From the bottom: rotations [deg] and translations [mm] about a frame.
inline marrow::Vector6d way(const marrow::RigidTransform& bottom, const marrow::RigidTransform& pose,
                            const marrow::FragmentFrame& frame) {
  marrow::Vector6d motion = marrow::motion_between(bottom, pose, frame);
  motion.head<3>() *= marrow::degrees(1);
  return motion;
}

/// The mean square of the six numbers of the way from the bottom, and on top of it waves of a height and a length.
class Well : public marrow::Cost {
 public:
  /// The levels that it was asked for, of all copies.
  struct Asked {
    std::mutex mutex;
    std::vector<marrow::CostLevel> levels;
  };
  Well(marrow::RigidTransform bottom, marrow::FragmentFrame frame, double height = 0, double length = 1)
      : bottom_(std::move(bottom)), frame_(std::move(frame)), height_(height), length_(length) {}

  double value(const marrow::RigidTransform& world_from_model) const override {
    const marrow::Vector6d motion = way(bottom_, world_from_model, frame_);
    double waves = 0;
    for (int k = 0; k < 6; ++k) waves += 0.5 * height_ * (1 - std::cos(2 * marrow::kPi * motion[k] / length_));
    return (motion.squaredNorm() + waves) / 6;
  }
  std::shared_ptr<const marrow::Cost> at_level(const marrow::CostLevel& level) const override {
    const std::lock_guard lock(asked->mutex);
    asked->levels.push_back(level);
    return std::make_shared<Well>(*this);
  }

  std::shared_ptr<Asked> asked = std::make_shared<Asked>();

 private:
  marrow::RigidTransform bottom_;
  marrow::FragmentFrame frame_;
  double height_, length_;
};

/// A pose that is no round number in any coordinate.
inline marrow::Pose truth() {
  marrow::Pose pose;
  pose.frame = {Eigen::Vector3d(5, -3, 80), marrow::rotation_from_vector({0.1, -0.2, 0.3}), true};
  pose.world_from_model = {"world", "ct", marrow::rotation_from_vector({0.2, 0.1, -0.4}), Eigen::Vector3d(12, -7, 30)};
  return pose;
}

/// A pose moved about its frame, in degrees and mm.
inline marrow::Pose pose_at(const marrow::Pose& from, double rx, double ry, double rz, double tx, double ty,
                            double tz) {
  marrow::Vector6d motion;
  motion << marrow::radians(rx), marrow::radians(ry), marrow::radians(rz), tx, ty, tz;
  marrow::Pose pose = from;
  pose.world_from_model = marrow::moved(from.world_from_model, from.frame, motion);
  return pose;
}

}  // namespace well
