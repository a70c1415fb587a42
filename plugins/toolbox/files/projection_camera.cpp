// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/files/projection_camera.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>

#include "marrow/domain/decompositions.hpp"

namespace marrow::files {

std::optional<ProjectionCamera> camera_of_projection(const Projection& pixel_from_world,
                                                     const Eigen::Vector2i& size_px) {
  const double scale = pixel_from_world.row(2).head<3>().norm();
  if (!pixel_from_world.allFinite() || !(scale > 1e-12)) return std::nullopt;
  const Projection p = pixel_from_world / scale;
  const Eigen::RowVector3d z = p.row(2).head<3>();
  // Decomposes P row by row: what the axes found so far leave of a row is along the next axis.
  const double v0 = p.row(1).head<3>().dot(z);
  const Eigen::RowVector3d y_scaled = p.row(1).head<3>() - v0 * z;
  const double f_v = y_scaled.norm();
  const Eigen::RowVector3d y = y_scaled / f_v, x = y.cross(z);
  const double u0 = p.row(0).head<3>().dot(z), skew = p.row(0).head<3>().dot(y), f_u = p.row(0).head<3>().dot(x);
  if (!(f_v > 1e-9) || !(std::abs(f_u) > 1e-9)) return std::nullopt;
  ProjectionCamera found;
  found.is_mirrored = f_u < 0;
  Camera& camera = found.camera;
  camera.width_px = size_px.x();
  camera.height_px = size_px.y();
  camera.intrinsics << f_u, skew, u0, 0, f_v, v0, 0, 0, 1;
  Eigen::Matrix3d axes;
  axes << x, y, z;
  camera.camera_from_world.rotation = nearest_orthogonal(axes);
  Eigen::Vector3d& t = camera.camera_from_world.translation_mm;
  t.z() = p(2, 3);
  t.y() = (p(1, 3) - v0 * t.z()) / f_v;
  t.x() = (p(0, 3) - u0 * t.z() - skew * t.y()) / f_u;
  return found;
}

Projection projection_of(const Detector& detector) {
  Eigen::Matrix3d axes;
  axes << detector.pixel_mm.x() * detector.columns, detector.pixel_mm.y() * detector.rows,
      detector.corner_mm - detector.source_mm;
  Projection p;
  p.leftCols<3>() = axes.inverse();
  p.col(3) = -p.leftCols<3>() * detector.source_mm;
  return p;
}

}  // namespace marrow::files
