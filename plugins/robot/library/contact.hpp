// SPDX-License-Identifier: Apache-2.0
#pragma once
// Whether the two fragments of a simulated bone overlap. Bone cannot go through bone.

#include "marrow/toolbox/phantom/phantom.hpp"
#include "marrow/toolbox/robotics/robot_state.hpp"

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

/// The fragment that a robot holds, and the load on it.
class Held {
 public:
  Held(const phantom::Phantom& phantom, const SoftTissue& tissue, const std::string& fragment,
       const std::string& reference, const std::string& what)
      : contact_(phantom, what),
        tissue_(tissue),
        moved_(phantom::fragment_named(phantom, fragment, what)),
        reference_(phantom::fragment_named(phantom, reference, what)) {
    if (moved_.side >= 0 || reference_.side <= 0)
      throw Error(what + ": the robot holds the distal fragment, and the proximal one stays; got '" + fragment +
                  "' and '" + reference + "'");
  }

  const phantom::Fragment& fragment() const { return moved_; }

  Load load_at(const RigidTransform& world_from_ct) const {
    const RigidTransform bone_from_distal =
        inverse(reference_.world_from_bone()) * (world_from_ct * moved_.ct_from_bone);
    return load_of(tissue_, motion_between(reference_.world_from_ct, world_from_ct, moved_.frame),
                   contact_.overlap_mm(bone_from_distal));
  }

 private:
  Contact contact_;
  SoftTissue tissue_;
  const phantom::Fragment& moved_;
  const phantom::Fragment& reference_;
};

}  // namespace marrow::robot
