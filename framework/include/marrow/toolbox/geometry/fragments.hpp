// SPDX-License-Identifier: Apache-2.0
#pragma once
// Two fragments of one bone: how one has moved relative to the other.
#include <string>

#include "marrow/domain/error.hpp"
#include "marrow/domain/list.hpp"
#include "marrow/domain/pose.hpp"

namespace marrow::geometry {

/// The names of two fragments.
struct FragmentPair {
  std::string moved = "distal";
  std::string reference = "proximal";
};

/// The pose of this name. Throws Error if there is none, or if a pose before it is not rigid or is between other frames
/// than the first one.
inline const Pose& pose_of(const List<Pose>& poses, const std::string& name) {
  std::string known;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    check_rigid(poses[i].world_from_model, "the pose of '" + poses.name(i) + "'");
    if (poses[i].world_from_model.source != poses[0].world_from_model.source ||
        poses[i].world_from_model.target != poses[0].world_from_model.target)
      throw Error("the poses of '" + poses.name(0) + "' and '" + poses.name(i) +
                  "' are between other frames; both fragments must come from one CT");
    if (poses.name(i) == name) return poses[i];
    known += (known.empty() ? "" : ", ") + poses.name(i);
  }
  throw Error("there is no pose of a fragment '" + name + "', only of " + known +
              "; name both fragments with moved and reference, and register both");
}

/// The small motion (r [rad], t [mm], see motion_between()) of the moved fragment about its own axes, relative to the
/// reference fragment: zero if both lie beside each other as in the CT. Throws Error as pose_of() does, or if both
/// names are the same.
inline Vector6d displacement(const List<Pose>& poses, const FragmentPair& pair) {
  if (pair.moved == pair.reference)
    throw Error("moved and reference both name '" + pair.moved + "'; they must be two fragments");
  const Pose &moved = pose_of(poses, pair.moved), &reference = pose_of(poses, pair.reference);
  return motion_between(reference.world_from_model, moved.world_from_model, moved.frame);
}

}  // namespace marrow::geometry
