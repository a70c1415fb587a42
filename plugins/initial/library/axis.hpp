// SPDX-License-Identifier: Apache-2.0
#pragma once
// The geometry of the chapter's first stage, as corrected in docs/method.md: planes from image lines, the axis in which
// they meet (Eq 7), and the motion that takes one axis to another (Eq 8).
#include <Eigen/Core>
#include <marrow/domain/camera.hpp>
#include <marrow/domain/features.hpp>
#include <marrow/domain/mesh.hpp>
#include <optional>
#include <vector>

namespace marrow::initial {

/// A straight line: a point and a unit direction.
struct Axis {
  Eigen::Vector3d point_mm = Eigen::Vector3d::Zero();
  Eigen::Vector3d direction = Eigen::Vector3d::UnitZ();

  Eigen::Vector3d nearest_to(const Eigen::Vector3d& point) const {
    return point_mm + direction * direction.dot(point - point_mm);
  }
};

/// The bisector, in world coordinates, of two planes: each goes through the source and one border (exact
/// back-projection M^T l). It contains the axis of a circular cylinder with these borders. (The mean of the two image
/// lines is not the image of that axis.) Both borders must run in the same direction.
Plane bisecting_plane(const Camera& camera, const LineSegment& left, const LineSegment& right);

/// Eq 7: the axis that lies in all planes, by least squares. point_mm is its point nearest to the origin. Throws Error
/// if the planes meet at less than 10 degrees, or if there are fewer than two.
Axis axis_of_planes(const std::vector<Plane>& planes);

/// Eq 8 as corrected: T_move = global_T_target (global_T_model)^-1, a motion in world coordinates. Both frames have z
/// along their axis. The model frame's origin is the point of the model's axis nearest to `anchor`; the target frame's
/// origin is the point of the target axis nearest to that. If the two directions are opposite, the target's is reversed
/// first. The x axes are chosen so that the model does not rotate about its axis or slide along it.
RigidTransform world_from_world_move(const Axis& model, const Axis& target, const Eigen::Vector3d& anchor);

// The borders of the model as a view would see them, measured in the same way as those of the image.

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
