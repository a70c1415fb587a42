// SPDX-License-Identifier: Apache-2.0
#pragma once
// Whether the two fragments of a simulated bone overlap. Bone cannot go through bone.
#include <vector>

#include "marrow/toolbox/phantom/phantom.hpp"

namespace marrow::robot {

/// The bone near its fracture: the outer surface as radii around the shaft's middle, the fracture as heights.
class Contact {
 public:
  /// Throws Error, naming `what`, unless the phantom has a fracture.
  Contact(const phantom::Phantom& phantom, const std::string& what);

  /// How deep the distal fragment reaches into the proximal one; 0 if they are apart. `bone_from_distal`: the distal
  /// fragment's place in the frame "bone" of the proximal one; the identity is the whole bone. Accurate to about 1 mm.
  double overlap_mm(const RigidTransform& bone_from_distal) const;

 private:
  double radius_mm(const Eigen::Vector3d& point) const;
  double height_mm(const Eigen::Vector3d& point) const;
  Eigen::Vector2d middle_at(double z) const;

  double first_z_ = 0;
  std::vector<Eigen::Vector2d> middles_;  ///< of each slice
  std::vector<double> radii_;             ///< slice by slice, for each angle
  Eigen::Vector2d first_xy_ = Eigen::Vector2d::Zero();
  int columns_ = 0, rows_ = 0;
  std::vector<double> heights_;
  std::vector<Eigen::Vector3d> distal_, proximal_;  ///< points on both fragments' surfaces
};

}  // namespace marrow::robot
