// SPDX-License-Identifier: Apache-2.0
#include "marrow/initial/axis.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <marrow/base/error.hpp>
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

namespace {

constexpr double kStep_px = 2;

/// The outermost point of the model on one side, at one position along the pair.
struct Extreme {
  double across = 0;      ///< position across the pair, in pixels
  Eigen::Vector3d world;  ///< the point of the surface
  bool seen = false;
};

/// Positions along and across a pair of borders. The origin is the midpoint between their first ends.
struct PairFrame {
  Eigen::Vector2d origin, along, across;
  double length = 0;

  explicit PairFrame(const ShaftLines& lines) {
    origin = 0.5 * (lines.left.from_px + lines.right.from_px);
    const Eigen::Vector2d end = 0.5 * (lines.left.to_px + lines.right.to_px);
    length = (end - origin).norm();
    along = (end - origin) / length;
    across = {-along.y(), along.x()};  // to the right
  }
  /// Maps a homogeneous pixel to its place in the pair, homogeneous too.
  Eigen::Matrix3d from_pixel() const {
    Eigen::Matrix3d map;
    map << along.x(), along.y(), -along.dot(origin), across.x(), across.y(), -across.dot(origin), 0, 0, 1;
    return map;
  }
  Eigen::Vector2d pixel(double s, double t) const { return origin + s * along + t * across; }
};

/// Where points of the model lie along and across a pair: one array for each, computed several at once. NaN for points
/// that are not in front of the source.
MARROW_DISPATCH void flatten(const Eigen::Vector3d* points, std::size_t count, const Eigen::Matrix3d& pair_from_model,
                             const Eigen::Vector3d& offset, double* along_px, double* across_px) {
  const Eigen::Matrix3d m = pair_from_model;
  const Eigen::Vector3d o = offset;
  for (std::size_t i = 0; i < count; ++i) {
    const double x = points[i][0], y = points[i][1], z = points[i][2];
    const double depth = m(2, 0) * x + m(2, 1) * y + m(2, 2) * z + o[2];
    const double inverse = depth > 0 ? 1 / depth : std::numeric_limits<double>::quiet_NaN();
    along_px[i] = (m(0, 0) * x + m(0, 1) * y + m(0, 2) * z + o[0]) * inverse;
    across_px[i] = (m(1, 0) * x + m(1, 1) * y + m(1, 2) * z + o[1]) * inverse;
  }
}

/// For each side the extremes at positions 0, 2, 4, ... along the pair, from the triangle edges that cross them.
std::array<std::vector<Extreme>, 2> extremes_of(const Mesh& model, const RigidTransform& world_from_model,
                                                const Camera& camera, const PairFrame& pair) {
  const std::size_t count = std::size_t(pair.length / kStep_px) + 1;
  std::array<std::vector<Extreme>, 2> sides{std::vector<Extreme>(count), std::vector<Extreme>(count)};
  std::vector<double> along_px(model.vertices_mm.size()), across_px(along_px.size());
  const RigidTransform camera_from_model = camera.camera_from_world * world_from_model;
  const Eigen::Matrix3d pair_from_camera = pair.from_pixel() * camera.intrinsics;
  flatten(model.vertices_mm.data(), along_px.size(), pair_from_camera * camera_from_model.rotation,
          pair_from_camera * camera_from_model.translation_mm, along_px.data(), across_px.data());
  const auto cross = [&](std::uint32_t a, std::uint32_t b) {
    if (along_px[a] > along_px[b]) std::swap(a, b);
    const double from = along_px[a], to = along_px[b];
    if (!(to > from) || to < 0 || from > pair.length) return;
    const long last = std::min(long(count) - 1, long(to / kStep_px));
    const long before = from > 0 ? long(from / kStep_px) : 0;  // std::ceil is a slow function call
    for (long k = before + (double(before) * kStep_px < from); k <= last; ++k) {
      const double part = (double(k) * kStep_px - from) / (to - from);
      const double across = across_px[a] + part * (across_px[b] - across_px[a]);
      for (int side = 0; side < 2; ++side) {
        Extreme& extreme = sides[side][std::size_t(k)];
        if (extreme.seen && (side == 0 ? across >= extreme.across : across <= extreme.across)) continue;
        extreme = {across, model.vertices_mm[a] + part * (model.vertices_mm[b] - model.vertices_mm[a]), true};
      }
    }
  };
  // Many triangles lie beside the pair, or between two positions.
  const auto is_apart = [&](const std::array<std::uint32_t, 3>& triangle) {
    const double a = along_px[triangle[0]], b = along_px[triangle[1]], c = along_px[triangle[2]],
                 low = std::min(std::min(a, b), c), high = std::max(std::max(a, b), c);
    return high < 0 || low > pair.length || (low > 0 && double(long(high / kStep_px)) < low / kStep_px);
  };
  for (const auto& triangle : model.triangles) {
    if (is_apart(triangle)) continue;
    for (int k = 0; k < 3; ++k)
      // Each edge belongs to two triangles. It is used only where its vertex numbers ascend. An edge at an open border
      // may be skipped, but other edges of its triangle cross the same positions.
      if (triangle[k] < triangle[(k + 1) % 3]) cross(triangle[k], triangle[(k + 1) % 3]);
  }
  for (auto& side : sides)
    for (Extreme& extreme : side)
      if (extreme.seen) extreme.world = world_from_model * extreme.world;
  return sides;
}

/// The line across = at_start + slope * s fitted to the extremes. In each round, those farther than the tolerance from
/// the line of the round before are left out.
struct Line {
  double at_start = 0, slope = 0;
  double at(double s) const { return at_start + slope * s; }
};
Line fitted(const std::vector<Extreme>& side, double tolerance_px) {
  Line line;
  double reach = std::numeric_limits<double>::infinity();
  for (int round = 0; round < 6; ++round) {
    double n = 0, sum_s = 0, sum_t = 0, sum_ss = 0, sum_st = 0;
    for (std::size_t k = 0; k < side.size(); ++k) {
      const double s = double(k) * kStep_px, t = side[k].across;
      if (!side[k].seen || std::abs(t - line.at(s)) > reach) continue;
      n += 1, sum_s += s, sum_t += t, sum_ss += s * s, sum_st += s * t;
    }
    const double spread = n * sum_ss - sum_s * sum_s;
    if (n < 3 || !(spread > 0)) break;
    line.slope = (n * sum_st - sum_s * sum_t) / spread;
    line.at_start = (sum_t - line.slope * sum_s) / n;
    reach = tolerance_px * std::max(1.0, 8.0 / (1 << round));  // from coarse to fine
  }
  return line;
}

/// The least-squares line through the midpoints between the surface points of both sides.
Axis axis_of_middles(const std::array<std::vector<Extreme>, 2>& sides) {
  Eigen::Vector3d first = Eigen::Vector3d::Zero();
  Eigen::Matrix3d second = Eigen::Matrix3d::Zero();
  double n = 0;
  for (std::size_t k = 0; k < sides[0].size(); ++k) {
    if (!sides[0][k].seen) continue;
    const Eigen::Vector3d middle = 0.5 * (sides[0][k].world + sides[1][k].world);
    n += 1, first += middle, second += middle * middle.transpose();
  }
  Axis axis;
  axis.point_mm = first / n;
  axis.direction = eigen_of_symmetric<3>(second / n - axis.point_mm * axis.point_mm.transpose()).vectors.col(2);
  return axis;
}

}  // namespace

std::optional<ModelBorders> model_borders(const Mesh& model, const RigidTransform& world_from_model,
                                          const Camera& camera, const ShaftLines& lines, double tolerance_px) {
  const PairFrame pair(lines);
  const auto sides = extremes_of(model, world_from_model, camera, pair);
  const auto seen =
      std::count_if(sides[0].begin(), sides[0].end(), [](const Extreme& extreme) { return extreme.seen; });
  if (seen < 5 || std::size_t(3 * seen) < sides[0].size()) return std::nullopt;
  const Line left = fitted(sides[0], tolerance_px), right = fitted(sides[1], tolerance_px);
  ModelBorders borders;
  borders.left = {pair.pixel(0, left.at(0)), pair.pixel(pair.length, left.at(pair.length))};
  borders.right = {pair.pixel(0, right.at(0)), pair.pixel(pair.length, right.at(pair.length))};
  borders.axis = axis_of_middles(sides);
  borders.width_px = right.at(pair.length / 2) - left.at(pair.length / 2);
  return borders;
}

}  // namespace marrow::initial
