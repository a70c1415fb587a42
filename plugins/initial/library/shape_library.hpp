// SPDX-License-Identifier: Apache-2.0
#pragma once
// The outlines of a surface from all sides, and the poses in which it looks like a silhouette that is seen (Jensen et
// al., Joint Track Machine Learning, arXiv 2205.00057).
#include <vector>

#include "marrow/domain/mesh.hpp"
#include "marrow/initial/outline_shape.hpp"
#include "marrow/initial/seen_silhouette.hpp"
#include "marrow/runtime/node/context.hpp"

namespace marrow::initial {

class ShapeLibrary {
 public:
  /// Draws the surface from `directions` sides, spread evenly, at the distance at which it is about as large as the
  /// silhouette.
  ShapeLibrary(const Mesh& surface, const SeenSilhouette& about, int directions, Context& context);

  struct Match {
    RigidTransform world_from_model;
    double likeness = 0;
  };
  /// For each side the pose in which the surface looks most like the silhouette, the most likely first. The shape
  /// gives the side and the turn in the image, the size gives the depth, and the middle gives the place.
  std::vector<Match> matches(const SeenSilhouette& seen) const;

 private:
  struct Side {
    Eigen::Matrix3d camera_from_model;
    OutlineShape shape;  ///< of rays about the one to middle_mm_
  };
  const std::string frame_;
  Eigen::Vector3d middle_mm_;
  double distance_mm_ = 0;
  std::vector<Side> sides_;
};

}  // namespace marrow::initial
