// SPDX-License-Identifier: Apache-2.0
#pragma once
// The axes about and along which a bone is moved by a search, or from frame to frame, and
// two fragments of one bone: how one has moved relative to the other.
#include <marrow/domain/pose.hpp>
#include <marrow/runtime/node/context.hpp>
#include <string>

#include "marrow/domain/list.hpp"

namespace marrow::geometry {

/// The pose with the axes of its fragment: its own, or those of `model`, the surface of the fragment, which may be
/// null. A covariance is turned into these axes. If there are neither, the pose stays as it is, and its frame is not
/// anatomical. Throws Error if the model is not in the frame of the pose's points.
Pose about_fragment_axes(Pose pose, const Mesh* model);

/// The same for a pose to start from. If it stays as it is, a warning goes to the log.
Pose with_fragment_axes(Pose start, const Mesh* model, const Context& context);

/// The names of two fragments.
struct FragmentPair {
  std::string moved = "distal";
  std::string reference = "proximal";
};

/// The item of this fragment. Throws Error, with the fragments that there are, if there is none. `what`: "surface".
template <class T>
const T& of_fragment(const List<T>& items, const std::string& fragment, const std::string& what) {
  if (const T* item = items.find(fragment)) return *item;
  std::string known;
  for (const std::string& name : items.names()) known += (known.empty() ? "" : ", ") + name;
  throw Error("there is no " + what + " of a fragment '" + fragment + "', only of " + known +
              "; name both fragments with moved and reference");
}

/// The pose of this name. Throws Error if there is none, as check_pose() does for it and for those before it, and if
/// one of these is between other frames than the first one.
inline const Pose& pose_of(const List<Pose>& poses, const std::string& name) {
  std::string known;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    check_pose(poses[i], "the pose of '" + poses.name(i) + "'");
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

/// The pose with the axes of its fragment: its own, or those of the fragment's surface in `models`, which may be null.
/// A covariance is turned into these axes. Throws Error if there are neither, and as check_model() does.
inline Pose with_own_axes(const Pose& pose, const std::string& name, const List<Mesh>* models) {
  const Pose result = about_fragment_axes(pose, models ? models->find(name) : nullptr);
  if (!result.frame.is_anatomical)
    throw Error("the pose of '" + name +
                "' does not say where the fragment's middle is and how its long axis runs, as a matrix alone does "
                "not; wire the surfaces of both fragments to 'models', or give the node that reads the pose its model");
  return result;
}

/// The poses of both fragments, with their own axes.
struct PosesOfPair {
  Pose moved, reference;
};
/// Throws Error as pose_of() and with_own_axes() do, and if both names are the same.
inline PosesOfPair poses_of_pair(const List<Pose>& poses, const FragmentPair& pair, const List<Mesh>* models) {
  if (pair.moved == pair.reference)
    throw Error("moved and reference both name '" + pair.moved + "'; they must be two fragments");
  return {with_own_axes(pose_of(poses, pair.moved), pair.moved, models),
          with_own_axes(pose_of(poses, pair.reference), pair.reference, models)};
}

}  // namespace marrow::geometry
