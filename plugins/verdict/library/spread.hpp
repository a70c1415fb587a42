// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cmath>
#include <marrow/domain/decompositions.hpp>
#include <marrow/domain/random.hpp>
#include <marrow/plugin.hpp>

#include "marrow/toolbox/geometry/targets.hpp"

namespace marrow::verdict {

/// A matrix whose product with six standard normal numbers has this covariance. check_pose() has refused one with a
/// negative eigenvalue; what is left of that is rounding.
inline Matrix6d root_of(const Matrix6d& covariance) {
  const auto eigen = eigen_of_symmetric<6>(covariance);
  return eigen.vectors * eigen.values.cwiseMax(0).cwiseSqrt().asDiagonal();
}

/// The errors that a pose's predicted covariance stands for: 10000 draws of the normal distribution, always the same.
struct Spread {
  static constexpr int kDraws = 10000;
  int off = 0, off_mm = 0, off_axial = 0;  ///< draws that are off (kMostError_mm), and in which respect
  double mtre_mm = 0, axial_deg = 0;       ///< root mean squares
};
/// Whether a pose has a covariance that comes from comparisons. A covariance of 0 comes from images that say nothing:
/// no registration knows a pose exactly.
inline bool is_determined(const Pose& pose) {
  return pose.covariance && pose.covariance->allFinite() && !pose.covariance->isZero(0);
}
/// The pose, with its covariance about and along the axes of the bone's surface, whatever axes it came with.
inline Pose about_the_bones_axes(const Pose& pose, const Mesh& mesh) {
  const FragmentFrame frame = fragment_frame(mesh);
  const bool has_them = pose.frame.origin_mm == frame.origin_mm && pose.frame.axes == frame.axes;
  return has_them ? pose : in_frame(pose, frame);
}
/// `as_found` has a finite covariance. The targets are 200 points of the mesh, which also gives the long axis.
inline Spread spread_of(const Pose& as_found, const Mesh& mesh) {
  constexpr int kTargets = 200;
  const Pose pose = about_the_bones_axes(as_found, mesh);
  const std::vector<Eigen::Vector3d> targets_mm = geometry::targets_mm(pose.world_from_model, &mesh, nullptr, kTargets);
  const Matrix6d root = root_of(*pose.covariance);
  Random random(1);
  Spread spread;
  for (int draw = 0; draw < Spread::kDraws; ++draw) {
    Vector6d motion;
    for (double& one : motion) one = random.normal();
    motion = (root * motion).eval();
    const double axial_deg = std::abs(degrees(motion[2]));
    const double mtre_mm = geometry::mean(geometry::target_errors_mm(moved(pose.world_from_model, pose.frame, motion),
                                                                     pose.world_from_model, targets_mm));
    const bool is_off_mm = mtre_mm > kMostError_mm, is_off_axial = axial_deg > kMostAxialError_deg;
    spread.off += is_off_mm || is_off_axial;
    spread.off_mm += is_off_mm;
    spread.off_axial += is_off_axial;
    spread.mtre_mm += mtre_mm * mtre_mm / Spread::kDraws;
    spread.axial_deg += axial_deg * axial_deg / Spread::kDraws;
  }
  spread.mtre_mm = std::sqrt(spread.mtre_mm);
  spread.axial_deg = std::sqrt(spread.axial_deg);
  return spread;
}

}  // namespace marrow::verdict
