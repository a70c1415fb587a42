// SPDX-License-Identifier: Apache-2.0
// Named points where a surface reaches farthest in given directions, such as the epicondyles of a femur. The same rule
// finds them on a simulated bone and on a patient's, so a network that learned them on the one finds them on the other.
#include <Eigen/Geometry>
#include <cmath>
#include <marrow/plugin.hpp>

#include "marrow/base/names.hpp"

namespace {

using namespace marrow;

struct Options {
  std::vector<std::string> names;
  std::vector<double> outward, back, up;
  std::string side = "left";
  std::string directions_of = "fragment";
  std::vector<std::string> level;
  double cap_mm = 3;
};

/// The directions in these axes, as unit vectors.
std::vector<Eigen::Vector3d> directions_of(const Options& options) {
  std::vector<Eigen::Vector3d> directions;
  const double left = options.side == "left" ? 1 : -1;
  for (std::size_t i = 0; i < options.names.size(); ++i) {
    const Eigen::Vector3d direction(left * options.outward[i], options.back[i], options.up[i]);
    if (!(direction.norm() > 0) || !direction.allFinite())
      throw Error("point '" + options.names[i] + "': outward, back and up are all 0; give a direction");
    directions.push_back(direction.normalized());
  }
  return directions;
}

/// The middle of the cap that a plane across the direction cuts off, cap_mm below its top. The middle hardly moves when
/// the surface is rough, where the top itself would jump.
Eigen::Vector3d middle_of_cap(const Mesh& model, const Eigen::Vector3d& direction, double cap_mm) {
  double top = -std::numeric_limits<double>::infinity();
  for (const auto& triangle : model.triangles)  // a mesh may hold vertices that no triangle has
    for (const std::uint32_t corner : triangle) top = std::max(top, direction.dot(model.vertices_mm[corner]));
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  double weights = 0;
  for (const auto& triangle : model.triangles) {
    const Eigen::Vector3d &a = model.vertices_mm[triangle[0]], &b = model.vertices_mm[triangle[1]],
                          &c = model.vertices_mm[triangle[2]];
    const Eigen::Vector3d middle = (a + b + c) / 3;
    // A triangle counts more the higher it is, so none of them enters or leaves at once.
    const double above = direction.dot(middle) - (top - cap_mm);
    if (above <= 0) continue;
    const double weight = above * 0.5 * (b - a).cross(c - a).norm();
    sum += weight * middle;
    weights += weight;
  }
  if (!(weights > 0))
    throw Error(
        formatted("no triangle of the surface lies within cap_mm, {} mm, of its extreme; make cap_mm larger", cap_mm));
  return sum / weights;
}

std::vector<Eigen::Vector3d> extremes(const Mesh& model, const Eigen::Matrix3d& axes,
                                      const std::vector<Eigen::Vector3d>& directions, double cap_mm) {
  std::vector<Eigen::Vector3d> points;
  for (const Eigen::Vector3d& direction : directions) points.push_back(middle_of_cap(model, axes * direction, cap_mm));
  return points;
}

std::size_t place_of(const std::string& name, const Options& options) {
  const auto found = std::find(options.names.begin(), options.names.end(), name);
  if (found == options.names.end())
    throw Error("level names '" + name + "', which is none of the points; " + suggestion(name, options.names));
  return std::size_t(found - options.names.begin());
}

/// The axes of the directions: the fragment's or the CT's, turned about the long axis until the two points of `level`
/// lie beside each other: a leg that was turned in the CT gets the same points. Throws Error if that does not settle.
Eigen::Matrix3d level_axes(const Mesh& model, const std::vector<Eigen::Vector3d>& directions, const Options& options) {
  Eigen::Matrix3d axes = options.directions_of == "ct" ? Eigen::Matrix3d::Identity() : fragment_frame(model).axes;
  if (options.level.empty()) return axes;
  if (options.level.size() != 2)
    throw Error(formatted("level: expected two names of points, got {}", options.level.size()));
  const std::size_t from = place_of(options.level[0], options), to = place_of(options.level[1], options);
  constexpr int kMostTurns = 40;
  constexpr double kSettled_rad = 1e-4;
  for (int turn = 0; turn < kMostTurns; ++turn) {
    const Eigen::Vector3d line = axes.transpose() * (middle_of_cap(model, axes * directions[to], options.cap_mm) -
                                                     middle_of_cap(model, axes * directions[from], options.cap_mm));
    const double off_rad = std::atan(line.y() / line.x());
    if (!std::isfinite(off_rad)) break;
    axes = axes * rotation_from_vector({0, 0, off_rad});
    if (std::abs(off_rad) < kSettled_rad) return axes;
  }
  throw Error("the points '" + options.level[0] + "' and '" + options.level[1] +
              "' do not settle beside each other; give no level, or points farther apart");
}

Landmarks points(const Mesh& model, const Options& options) {
  check_mesh(model, "model");
  const std::vector<Eigen::Vector3d> directions = directions_of(options);
  const std::vector<Eigen::Vector3d> places =
      extremes(model, level_axes(model, directions, options), directions, options.cap_mm);
  Landmarks landmarks;
  for (std::size_t i = 0; i < places.size(); ++i) landmarks.points.push_back({options.names[i], places[i]});
  return landmarks;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("points.extremes", points)
      .summary(
          "Named points where a surface reaches farthest in directions that are given in the axes of the fragment or "
          "the CT")
      .in("model", "surface of the fragment, in CT coordinates whose axes point to the left, to the back and up")
      .out("points", "the middles of the caps at the extremes, in CT coordinates")
      .option("names", &Options::names, "names of the points")
      .option("outward", &Options::outward,
              "the directions' components away from the body's middle, across the long axis; one for each name")
      .option("back", &Options::back, "their components to the back")
      .option("up", &Options::up, "their components along the long axis")
      .relation(at_least_one({"names"}))
      .relation(distinct("names"))
      .relation(same_length({"names", "outward", "back", "up"}))
      .option("side", &Options::side, "side of the body; outward is to the left for left", one_of({"left", "right"}))
      .option("directions_of", &Options::directions_of,
              "whose axes the directions are in. fragment: its long axis is up, and back is the CT's, across it; ct: "
              "those of the CT, for a bone that is not long",
              one_of({"fragment", "ct"}))
      .option("level", &Options::level,
              "two of the names: the axes are turned about the one that is up until these points lie beside each "
              "other; none: they are not turned")
      .option("cap_mm", &Options::cap_mm, "height of the cap at the extreme whose middle is the point", at_least(0.1),
              at_most(50));
}
