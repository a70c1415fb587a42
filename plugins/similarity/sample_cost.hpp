// SPDX-License-Identifier: Apache-2.0
#pragma once
// A cost without images, for nodes that add something to a cost.
#include <memory>
#include <optional>

#include "marrow/domain/functions.hpp"
#include "marrow/domain/pose.hpp"

namespace marrow::conformance {

/// Half the squared distance from a pose along the six axes of `frame`, in units of 1 degree and 1 mm.
/// Alike at all levels.
class DistanceCost : public Cost {
 public:
  DistanceCost(RigidTransform middle, FragmentFrame frame) : middle_(std::move(middle)), frame_(std::move(frame)) {}

  double value(const RigidTransform& pose) const override { return 0.5 * units(pose).squaredNorm(); }
  std::shared_ptr<const Cost> at_level(const CostLevel&) const override {
    return std::make_shared<DistanceCost>(*this);
  }

  std::optional<Expansion> expansion(const RigidTransform& pose, const FragmentFrame& frame) const override {
    // By central differences of the six residuals: Gauss-Newton.
    constexpr double kStep = 1e-5;
    const Vector6d here = units(pose);
    Matrix6d change;
    for (int axis = 0; axis < 6; ++axis) {
      const Vector6d step = kStep * Vector6d::Unit(axis);
      change.col(axis) = (units(moved(pose, frame, step)) - units(moved(pose, frame, -step))) / (2 * kStep);
    }
    return Expansion{0.5 * here.squaredNorm(), change.transpose() * here, change.transpose() * change};
  }

 private:
  Vector6d units(const RigidTransform& pose) const {
    Vector6d motion = motion_between(middle_, pose, frame_);
    motion.head<3>() *= degrees(1);
    return motion;
  }

  RigidTransform middle_;
  FragmentFrame frame_;
};

}  // namespace marrow::conformance
