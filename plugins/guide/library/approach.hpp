// SPDX-License-Identifier: Apache-2.0
#pragma once
// The way of a fragment to its place beside the other one, without their bones touching.
#include <string>
#include <vector>

#include "marrow/domain/mesh.hpp"
#include "marrow/domain/volume.hpp"
#include "marrow/guide/servo.hpp"

namespace marrow::guide {

/// How far two fragments of one CT are apart. Both are given in the coordinates of the CT, where they lie as in the
/// restored bone.
class Gap {
 public:
  struct Bone {
    const Mesh& surface;
    const SignedField& field;
  };
  /// Refers to the fields. Throws Error, naming the fragments, if they are nowhere near each other in the CT.
  Gap(const Bone& moved, const Bone& reference);

  /// The least distance between both surfaces near the fracture; negative where they overlap. Distances beyond the
  /// fields' bands count as the bands.
  double distance_mm(const RigidTransform& reference_from_fragment) const;

 private:
  const SignedField& of_moved_;
  const SignedField& of_reference_;
  std::vector<Eigen::Vector3d> on_moved_, on_reference_;
};

/// The next part of the way.
struct Leg {
  Vector6d error;     ///< from the next place to where the fragment is (servo.hpp)
  std::string stage;  ///< distract, rotate, align or release
};

struct ApproachOptions {
  double clearance_mm = 1;         ///< bones are kept this far apart, but less near their place in the restored bone
  double max_distraction_mm = 14;  ///< from the fragment's final place
  double rotated_deg = 2;          ///< smaller rotations do not count as a stage of their own
  double aligned_mm = 2;           ///< the same for shifts across the shaft
};

/// Straight away from the other fragment, along its shaft.
Leg leg_apart(const FragmentFrame& frame, const FragmentFrame& reference, double by_mm);

/// Takes the straight way if it is free. Otherwise the fragment first goes to a place that is pulled away along the
/// shaft, as little as possible. If the way to this place is not free, the fragment is first pulled away from where it
/// is. If no way is free, it is turned where it is pulled away as far as allowed. `frame`: of the fragment; its long
/// axis points to the other fragment or away from it.
Leg next_leg(const Gap& gap, const RigidTransform& reference_from_fragment, const FragmentFrame& frame,
             const FragmentFrame& reference, const ApproachOptions& options);

}  // namespace marrow::guide
