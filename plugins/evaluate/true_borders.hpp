// SPDX-License-Identifier: Apache-2.0
#pragma once
// The exact borders of a bone in an image, from its known surface and pose. Nodes that find borders must not use this.
#include <marrow/domain/camera.hpp>
#include <marrow/domain/features.hpp>
#include <marrow/domain/mesh.hpp>
#include <optional>

namespace true_borders {

struct Borders {
  marrow::LineSegment left, right;
  double width_px = 0;        ///< distance of the borders in the middle, measured across them
  Eigen::Vector3d middle_mm;  ///< the middle of the surface's outline along the pair, in world coordinates
};

/// Least-squares lines of a surface's outline on both sides, along a pair of borders. The outline consists of the mesh
/// edges where the surface turns away from the X-ray source (the contour generator; Cipolla and Giblin, Visual Motion
/// of Curves and Surfaces, 2000) or ends. At every pixel along the pair, the outermost point of these edges counts. The
/// farthest point is removed until all points lie within `tolerance_mm`, at the middle of this outline, of the line;
/// this removes broken ends and the flare at a joint. Nothing if the surface appears along less than a third of the
/// pair, or along less than 10 px.
std::optional<Borders> borders_beside(const marrow::ShaftLines& pair, const marrow::Mesh& model,
                                      const marrow::RigidTransform& world_from_model, const marrow::Camera& camera,
                                      double tolerance_mm);

}  // namespace true_borders
