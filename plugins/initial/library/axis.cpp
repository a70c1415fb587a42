// SPDX-License-Identifier: Apache-2.0
#include "marrow/initial/axis.hpp"

#include <Eigen/Geometry>
#include <cmath>
#include <marrow/base/error.hpp>
#include <string>
#include "marrow/base/number_text.hpp"
#include "marrow/domain/decompositions.hpp"

namespace marrow::initial {
namespace {

Eigen::Vector3d line_through(const LineSegment& segment) {
  return segment.from_px.homogeneous().cross(segment.to_px.homogeneous());
}

}  // namespace

Plane bisecting_plane(const Camera& camera, const LineSegment& left, const LineSegment& right) {
  const Plane one = back_project_line(camera, line_through(left)),
              other = back_project_line(camera, line_through(right));
  Plane plane;
  plane.normal = (one.normal + other.normal).normalized();  // borders of the same direction have similar normals
  plane.offset_mm = plane.normal.dot(source_position_mm(camera));
  return plane;
}

Axis axis_of_planes(const std::vector<Plane>& planes) {
  Eigen::MatrixXd normals(planes.size(), 3);
  Eigen::VectorXd offsets(planes.size());
  for (std::size_t i = 0; i < planes.size(); ++i) {
    normals.row(Eigen::Index(i)) = planes[i].normal.transpose();
    offsets(Eigen::Index(i)) = planes[i].offset_mm;
  }
  const SymmetricEigen<3> squares = eigen_of_symmetric<3>(normals.transpose() * normals);  // ascending
  const double spread = planes.size() < 2 ? 0 : std::sqrt(squares.values(1) / squares.values(2));
  // For two planes at an angle a the squared singular values are 1 +- cos a. Their ratio is tan(a / 2)^2.
  const double angle_deg = degrees(2 * std::atan(spread));
  if (angle_deg < 10) {
    const std::string text = formatted("{:.1f}", angle_deg);
    throw Error(
        formatted("the {} views see the shaft from nearly the same side: the planes of its axis meet at {} degrees, "
                  "but 10 are needed; use views farther apart, or a single one",
                  planes.size(), text));
  }
  Axis axis;
  axis.direction = squares.vectors.col(0);
  const Eigen::Vector3d right = normals.transpose() * offsets;
  for (Eigen::Index i = 1; i < 3; ++i)  // pseudo-inverse of rank two
    axis.point_mm += squares.vectors.col(i) * (squares.vectors.col(i).dot(right) / squares.values(i));
  return axis;
}

RigidTransform world_from_world_move(const Axis& model, const Axis& target, const Eigen::Vector3d& anchor) {
  const Eigen::Vector3d target_z =
      target.direction.dot(model.direction) < 0 ? Eigen::Vector3d(-target.direction) : target.direction;
  const Eigen::Matrix3d turn = Eigen::Quaterniond::FromTwoVectors(model.direction, target_z).toRotationMatrix();
  const Eigen::Vector3d model_x = model.direction.unitOrthogonal();

  const auto frame_at = [](const Eigen::Vector3d& origin, const Eigen::Vector3d& x, const Eigen::Vector3d& z) {
    RigidTransform world_from_frame{"world", "axis"};
    world_from_frame.rotation << x, z.cross(x), z;
    world_from_frame.translation_mm = origin;
    return world_from_frame;
  };
  const Eigen::Vector3d model_origin = model.nearest_to(anchor);
  const RigidTransform world_from_model_axis = frame_at(model_origin, model_x, model.direction);
  const RigidTransform world_from_target_axis = frame_at(target.nearest_to(model_origin), turn * model_x, target_z);
  return world_from_target_axis * inverse(world_from_model_axis);
}

}  // namespace marrow::initial
