// SPDX-License-Identifier: Apache-2.0
#pragma once
// A pose that is judged, and what all evidence for or against it needs.
#include <marrow/plugin.hpp>
#include <memory>
#include <vector>

namespace marrow::verdict {

/// A pose with the points of the bone that say how far another pose is from it. Refers to the context.
struct Judged {
  Pose pose;
  FragmentFrame frame;                      ///< of the bone's surface
  std::vector<Eigen::Vector3d> targets_mm;  ///< in the model's frame
  const Optimizer* optimizer = nullptr;
  const Context* context = nullptr;

  /// The mean distance of the targets between the pose and another one (mTRE).
  double off_mm(const RigidTransform& other) const;
  /// The angle about the bone's long axis between the pose and another one.
  double axial_deg(const RigidTransform& other) const;
  /// The pose after a motion about and along the bone's axes, in degrees and mm.
  RigidTransform moved_by(const RigidTransform& from, const Vector6d& deg_and_mm) const;
};

/// A pose and its cost.
struct Minimum {
  RigidTransform pose;
  double value = 0;
};

/// The first steps of a search, and the part of them at which it ends.
struct FirstSteps {
  double deg, axial_deg, mm, tolerance;
};
/// Minimises a cost from a pose over all six axes of the bone.
Minimum minimum_near(const Judged& judged, const Cost& cost, const RigidTransform& from, const FirstSteps& steps,
                     int max_evaluations);

/// Three poses from which a search should come back to the pose.
std::vector<RigidTransform> near_starts(const Judged& judged);

/// How far another pose of the bone is from the pose: mTRE, and about the long axis.
struct Apart {
  double mm = 0, deg = 0;
};
/// How far a second cost leads from the pose: the medians over the best of the minima that it has around it.
Apart second_cost(const Judged& judged, const Cost& cost);

/// Figures for or against a pose: 0 speaks for it, a larger value against it.
using Evidence = std::vector<Metric>;

/// How the cost changes around the pose. `prefix` is put before each figure's name.
Evidence landscape(const Judged& judged, const Cost& cost, const std::string& prefix);
/// Other minima: searches from elsewhere that end in a cost about as low.
Evidence other_minima(const Judged& judged, const Cost& coarse, const Cost& cost);
/// Where each view alone would move the bone: in its image, and about the long axis.
Evidence views_alone(const Judged& judged, const Cost& cost, const List<View>& views, const std::string& prefix);
/// How the outline lies on the images' edges.
Evidence outline_on_edges(const Judged& judged, const OutlineProjector& projector, const List<View>& views,
                          const List<EdgeMap>& edges);

/// How deep the bone reaches into other bones: the largest depth of 2000 points of its surface. `others` are the poses
/// of other bones, and maybe of this one; `other_bones` has a signed field of the same name for each. Throws Error if
/// one is missing.
double intersection_mm(const Judged& judged, const Mesh& mesh, const List<Pose>& others,
                       const List<SignedField>& other_bones);

}  // namespace marrow::verdict
