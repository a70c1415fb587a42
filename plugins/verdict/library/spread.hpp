// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <marrow/plugin.hpp>

namespace marrow::verdict {

/// The errors that a pose's predicted covariance stands for: 10000 draws of the normal distribution, always the same.
struct Spread {
  static constexpr int kDraws = 10000;
  int off = 0, off_mm = 0, off_axial = 0;  ///< draws that are off (kMostError_mm), and in which respect
  double mtre_mm = 0, axial_deg = 0;       ///< root mean squares
};
/// Whether a pose has a covariance that comes from comparisons. A covariance of 0 comes from images that say nothing:
/// no registration knows a pose exactly.
bool is_determined(const Pose& pose);
/// The pose, with its covariance about and along the axes of the bone's surface, whatever axes it came with.
Pose about_the_bones_axes(const Pose& pose, const Mesh& mesh);
/// `pose` has a finite covariance. The targets are 200 points of the mesh, which also gives the long axis.
Spread spread_of(const Pose& pose, const Mesh& mesh);

}  // namespace marrow::verdict
