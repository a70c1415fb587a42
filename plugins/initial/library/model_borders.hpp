// SPDX-License-Identifier: Apache-2.0
#pragma once
// The borders of the model as a view would see them, measured in the same way as those of the image.
#include <Eigen/Core>
#include <marrow/domain/camera.hpp>
#include <marrow/domain/features.hpp>
#include <marrow/domain/mesh.hpp>
#include <optional>

#include "marrow/initial/axis.hpp"

namespace marrow::initial {

struct ModelBorders {
  LineSegment left, right;
  Axis axis;            ///< through the midpoints between the two silhouettes, in world coordinates
  double width_px = 0;  ///< distance of the borders in the middle
};

/// The borders of a model's silhouette at a pose, over the stretch of the image that a pair of borders spans. At every
/// second pixel along the pair the outermost points of the model on both sides are taken. Each side is fitted by a
/// straight line; points farther than `tolerance_px` from it are left out. So the model is measured like the pair:
/// borders and not centroids (a ridge shifts a centroid, but not a border), and at the same part of the shaft (a bowed
/// shaft has another axis elsewhere). std::nullopt if less than a third of the stretch shows the model.
std::optional<ModelBorders> model_borders(const Mesh& model, const RigidTransform& world_from_model,
                                          const Camera& camera, const ShaftLines& lines, double tolerance_px);

}  // namespace marrow::initial
