// SPDX-License-Identifier: Apache-2.0
#pragma once
// Where the borders of a bone of known surface and pose are in an image, exactly. No node that finds them may use this.
#include <marrow/domain/camera.hpp>
#include <marrow/domain/features.hpp>
#include <marrow/domain/mesh.hpp>
#include <optional>

namespace true_borders {

struct Borders {
  marrow::LineSegment left, right;
  double width_px = 0;  ///< their distance in the middle of the stretch, across it
};

/// The outline of a surface in the stretch of the image that a pair of borders spans, and its least-squares line on
/// either side. The outline is that of the triangles themselves: it is made of edges at which the surface turns away
/// from the X-ray source (the contour generator; Cipolla and Giblin, Visual Motion of Curves and Surfaces, 2000) or
/// ends. At every pixel along the pair, the outermost point of these edges counts. As long as one is farther than
/// `tolerance_px` from the line, the farthest is left out: a broken end, the flare at a joint. Nothing where less than
/// a third of the stretch shows the surface.
std::optional<Borders> borders_beside(const marrow::ShaftLines& pair, const marrow::Mesh& model,
                                      const marrow::RigidTransform& world_from_model, const marrow::Camera& camera,
                                      double tolerance_px);

}  // namespace true_borders
