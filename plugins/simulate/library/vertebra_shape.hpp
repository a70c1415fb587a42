// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>

#include "marrow/simulate/shape_functions.hpp"

namespace marrow::phantom {

/// Parameters of a lumbar vertebra. Defaults are near the means of L3 (Panjabi et al., Spine 1992).
struct VertebraShape {
  double body_width_mm = 45;
  double body_depth_mm = 34;
  double body_height_mm = 27;
  double canal_width_mm = 24;
  double canal_depth_mm = 17.5;
  double pedicle_width_mm = 10;
  double pedicle_height_mm = 14.5;
  double transverse_width_mm = 86;  ///< between the tips of the transverse processes
  double length_mm = 87;            ///< from the front of the body to the tip of the spinous process
  double waist_mm = 2.5;            ///< by which the body's wall is narrower in the middle of its height
  double dish_mm = 1.5;             ///< depth of the end plates
  double shell_mm = 1;              ///< thickness of the cortical bone
  double ripple_mm = 0;             ///< amplitude of smooth irregularities of the surface
  std::uint64_t seed = 1;
};

/// A vertebra as two continuous fields, negative inside. Near the surface they are about the distance in mm. Points are
/// in frame "bone", with the middle of the vertebral body at the origin. Safe to use from several threads.
class VertebraField {
 public:
  explicit VertebraField(const VertebraShape& shape);
  double outer(const Eigen::Vector3d& point_mm) const;
  /// The endosteal surface: shell_mm inside the outer surface.
  double inner(const Eigen::Vector3d& point_mm) const { return outer(point_mm) + shape_.shell_mm; }

  /// Corners of a box that contains the vertebra.
  Eigen::Vector3d low_mm() const;
  Eigen::Vector3d high_mm() const;

 private:
  double body(const Eigen::Vector3d& p) const;
  double arch(const Eigen::Vector3d& p) const;
  double canal(const Eigen::Vector3d& p) const;

  VertebraShape shape_;
  double scale_;  ///< of the parts without a measure of their own, from the body's width
  Ripple ripple_;
};

}  // namespace marrow::phantom
