// SPDX-License-Identifier: Apache-2.0
#pragma once
// The model's borders as a view would see them, measured as the image's are.
#include <Eigen/Core>
#include <marrow/domain/camera.hpp>
#include <marrow/domain/features.hpp>
#include <marrow/domain/mesh.hpp>
#include <optional>

#include "marrow/toolbox/shaft/axis.hpp"

namespace marrow::shaft {

struct ModelBorders {
  LineSegment left, right;
  Axis axis;            ///< through the middles between the two silhouettes, in world coordinates
  double width_px = 0;  ///< distance of the borders in the middle
};

/// The silhouette of a model at a pose, over the stretch of the image that a pair of borders spans: at every second
/// pixel along the pair the outermost points of the model on both sides, each side fitted by a straight line. Both what
/// is measured (a ridge on the bone shifts a centroid, but not a border) and where (a bowed shaft has another axis
/// elsewhere) are those of the pair. Nothing when less than a third of the stretch shows the model.
std::optional<ModelBorders> model_borders(const Mesh& model, const RigidTransform& world_from_model,
                                          const Camera& camera, const ShaftLines& lines, double tolerance_px);

}  // namespace marrow::shaft
