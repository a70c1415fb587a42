// SPDX-License-Identifier: Apache-2.0
#pragma once
// Two fragments of one bone: where one has moved against the other.
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

/// The pose of that name. Throws Error where there is none, or the poses do not take points in the same frame to the
/// world.
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

/// The small motion that has displaced the moved fragment from where it belongs, about its own axes: it belongs where
/// the CT shows it beside the other one.
inline Vector6d displacement(const List<Pose>& poses, const FragmentPair& pair) {
  if (pair.moved == pair.reference)
    throw Error("moved and reference both name '" + pair.moved + "'; they must be two fragments");
  const Pose &moved = pose_of(poses, pair.moved), &reference = pose_of(poses, pair.reference);
  return motion_between(reference.world_from_model, moved.world_from_model, moved.frame);
}

}  // namespace marrow::geometry
