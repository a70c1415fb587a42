// SPDX-License-Identifier: Apache-2.0
#pragma once
// An implant with holes for locking screws, and where a drill has to go to lock it.
#include <Eigen/Core>
#include <string>
#include <vector>

#include "marrow/runtime/node/types.hpp"

namespace marrow::geometry {

/// A straight hole through an implant, in the implant's frame.
struct Hole {
  std::string name;
  Eigen::Vector3d centre_mm = Eigen::Vector3d::Zero();  ///< in the middle of the implant
  Eigen::Vector3d axis = Eigen::Vector3d::UnitX();      ///< of length 1; both directions mean the same
  double diameter_mm = 5;
  using fields = Fields<&Hole::name, &Hole::centre_mm, &Hole::axis, &Hole::diameter_mm>;
};

/// A solid body of metal in a frame of its own, called "implant". The z axis of a nail runs along it, from the tip in
/// the knee upwards.
struct Implant {
  Mesh surface;  ///< closed
  std::vector<Hole> holes;
  using fields = Fields<&Implant::surface, &Implant::holes>;
};

/// Throws Error, naming `what`, unless the surface is closed and oriented outward, there is a hole, the holes have
/// different names, and each has an axis of length 1 and a diameter above 0.
void check_implant(const Implant& implant, const std::string& what);

/// The axis with length 1. Throws Error, naming `what` and the hole, if its length is 0 or not finite.
Eigen::Vector3d unit_axis(const Eigen::Vector3d& axis, const std::string& what, const std::string& hole);

/// Where a drill has to go to lock a nail, in world coordinates.
struct LockingPlan {
  struct Drill {
    std::string hole;
    Eigen::Vector3d centre_mm = Eigen::Vector3d::Zero();   ///< of the hole
    Eigen::Vector3d direction = Eigen::Vector3d::UnitX();  ///< in which the drill advances; of length 1
    double diameter_mm = 5;
    Eigen::Vector3d guide_mm = Eigen::Vector3d::Zero();  ///< where the drill guide stands, on the axis before the hole
    /// Predicted root mean squares: the angle between planned and true axis, and the distance between the two at the
    /// hole's centre. NaN if the pose has no covariance.
    double deviation_deg = 0, deviation_mm = 0;
    /// The 95th percentiles of these angles and distances.
    double most_deg = 0, most_mm = 0;
    /// The C-arm's angles at which the ray through the hole's centre runs along its axis. So it is seen as a circle.
    double alpha_deg = 0, beta_deg = 0;
    std::vector<std::string> doubts;  ///< in words; empty if the axis can be relied on
    using fields = Fields<&Drill::hole, &Drill::centre_mm, &Drill::direction, &Drill::diameter_mm, &Drill::guide_mm,
                          &Drill::deviation_deg, &Drill::deviation_mm, &Drill::most_deg, &Drill::most_mm,
                          &Drill::alpha_deg, &Drill::beta_deg, &Drill::doubts>;
  };
  std::vector<Drill> drills;
  /// The C-arm for which the angles hold.
  Eigen::Vector3d isocentre_mm = Eigen::Vector3d::Zero();
  double source_to_isocentre_mm = 600;
  using fields = Fields<&LockingPlan::drills, &LockingPlan::isocentre_mm, &LockingPlan::source_to_isocentre_mm>;
};

}  // namespace marrow::geometry

MARROW_VALUE_TYPE(marrow::geometry::Implant, "implant", 1)

MARROW_VALUE_TYPE(marrow::geometry::LockingPlan, "locking_plan", 2)
