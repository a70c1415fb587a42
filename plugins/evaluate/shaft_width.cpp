// SPDX-License-Identifier: Apache-2.0
// The shaft's outer diameter from two views or more. Each border and its X-ray source span a plane that touches the
// bone. A tapering bone that touches all planes has a known depth, so the magnification need not be assumed.
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <marrow/plugin.hpp>

namespace {

using marrow::LineSegment, marrow::List, marrow::ShaftLines, marrow::View;

struct Options {
  std::vector<double> width_mm, width_deviation_mm;
};

/// A range of diameters that a shaft may have.
struct Possible {
  double least_mm, most_mm;
};

/// One range for each given width. Without widths, one range for a femur: 366 femora had perimeters of 69 to 116 mm at
/// mid-shaft (J Clin Med Res 11, 2019, 740), which means diameters of 22 to 37 mm. The range goes from a third less to
/// half as much again, for other people, directions and levels.
std::vector<Possible> possible_diameters(const Options& options) {
  std::vector<Possible> possible;
  for (std::size_t i = 0; i < options.width_mm.size(); ++i) {
    const double mean = options.width_mm[i], deviation = options.width_deviation_mm.at(i);
    if (!(mean > 0) || !(deviation > 0)) throw marrow::Error("width_mm and width_deviation_mm must be positive");
    possible.push_back({mean - 3 * deviation, mean + 3 * deviation});
  }
  return possible.empty() ? std::vector<Possible>{{15, 55}} : possible;
}

/// "15.0 to 55.0 mm"
std::string range(const std::vector<Possible>& possible) {
  double least = possible[0].least_mm, most = possible[0].most_mm;
  for (const Possible& one : possible) least = std::min(least, one.least_mm), most = std::max(most, one.most_mm);
  return marrow::formatted("{:.1f} to {:.1f} mm", least, most);
}

/// The pair of borders of one view, in world coordinates.
struct Sight {
  Eigen::Vector3d source_mm, ray;  ///< the ray runs through the middle of the pair
  /// Unit normals of the planes through the source that touch the bone. They point away from the bone.
  Eigen::Vector3d left, right;
};

Sight sight_of(const View& view, const ShaftLines& lines) {
  const auto middle = [](const LineSegment& border) { return Eigen::Vector2d(0.5 * (border.from_px + border.to_px)); };
  Sight sight;
  sight.source_mm = marrow::source_position_mm(view.camera);
  sight.ray = marrow::ray_direction(view.camera, 0.5 * (middle(lines.left) + middle(lines.right)));
  const auto outwards = [&](const LineSegment& border) {
    const Eigen::Vector3d normal = marrow::ray_direction(view.camera, border.from_px)
                                       .cross(marrow::ray_direction(view.camera, border.to_px))
                                       .normalized();
    return Eigen::Vector3d(normal.dot(sight.ray) > 0 ? -normal : normal);
  };
  sight.left = outwards(lines.left), sight.right = outwards(lines.right);
  return sight;
}

/// A straight, evenly tapering bone. The planes through the borders of view v have the distance `distance_mm[v] +
/// slope[v] * t` from the axis point `point_mm + t * direction`. Each view has its own distance, because a bone need
/// not be round.
struct Taper {
  Eigen::Vector3d point_mm, direction;
  Eigen::VectorXd distance_mm, slope;
};

/// Throws Error if all views see the bone from nearly the same side, because then its depth is not determined.
void check_sides(const std::vector<Sight>& sights) {
  double widest_deg = 0;
  for (const Sight& a : sights)
    for (const Sight& b : sights) {
      const Eigen::Vector3d one = a.left - a.right, other = b.left - b.right;
      widest_deg = std::max(widest_deg, marrow::degrees(std::atan2(one.cross(other).norm(), std::abs(one.dot(other)))));
    }
  const std::string angle = marrow::formatted("{:.1f}", widest_deg);
  if (widest_deg < 10)
    throw marrow::Error(
        marrow::formatted("the {} views see the shaft from nearly the same side: the planes of its axis meet at {} "
                          "degrees, but 10 are needed; use views farther apart",
                          sights.size(), angle));
}

/// A plane {X : n . X = o} touches the bone if n . (point + t direction) + distance_v + slope_v t = o for all t. So
/// (point, distance) is the least-squares solution of a linear system, and (direction, slope) spans its null space.
Taper touching_all(const std::vector<Sight>& sights) {
  check_sides(sights);
  const Eigen::Index views = Eigen::Index(sights.size());
  Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(2 * views, 3 + views);
  Eigen::VectorXd offsets_mm(2 * views);
  for (Eigen::Index v = 0; v < views; ++v)
    for (Eigen::Index side = 0; side < 2; ++side) {
      const Sight& sight = sights[std::size_t(v)];
      const Eigen::Vector3d& normal = side == 0 ? sight.left : sight.right;
      rows.row(2 * v + side).head<3>() = normal.transpose();
      rows(2 * v + side, 3 + v) = 1;
      offsets_mm(2 * v + side) = normal.dot(sight.source_mm);
    }
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(rows, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Eigen::Index rank = 2 + views;
  const Eigen::VectorXd at =
      svd.matrixV().leftCols(rank) *
      (svd.matrixU().leftCols(rank).transpose() * offsets_mm).cwiseQuotient(svd.singularValues().head(rank));
  const Eigen::VectorXd along = svd.matrixV().col(rank) / svd.matrixV().col(rank).head<3>().norm();
  return {at.head<3>(), along.head<3>(), at.tail(views), along.tail(views)};
}

/// The diameter at the point of the axis that is nearest to the ray through the middle of a view's pair. It is measured
/// across the axis. The radius of a cone across its axis is the distance of its tangent planes, divided by the cosine
/// of half the opening angle.
double diameter_mm(const Taper& bone, const Sight& sight, Eigen::Index view) {
  const Eigen::Vector3d across = bone.direction.cross(sight.ray).cross(sight.ray);
  const double t = across.dot(sight.source_mm - bone.point_mm) / across.dot(bone.direction), slope = bone.slope(view);
  return 2 * (bone.distance_mm(view) + slope * t) / std::sqrt(1 - slope * slope);
}

std::optional<marrow::Metrics> shaft_width(const List<ShaftLines>& lines, const List<View>& views,
                                           const Options& options, marrow::Context& context) {
  const std::vector<Possible> possible = possible_diameters(options);
  std::vector<Sight> sights;
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const View* view = views.find(lines.name(i));
    if (!view)
      throw marrow::Error("there are shaft lines of a view '" + lines.name(i) +
                          "', but no such view; wire the views that the lines were found in");
    marrow::check_camera(view->camera, "view '" + view->name + "'");
    sights.push_back(sight_of(*view, lines[i]));
  }
  if (sights.size() < 2) {
    context.warn(
        "only one view has shaft lines, so the distance of the bone from the source, and with it its diameter, is not "
        "known");
    return std::nullopt;
  }
  const Taper bone = touching_all(sights);
  marrow::Metrics metrics;
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const double width_mm = diameter_mm(bone, sights[i], Eigen::Index(i));
    const auto holds = [&](const Possible& one) { return width_mm >= one.least_mm && width_mm <= one.most_mm; };
    if (std::none_of(possible.begin(), possible.end(), holds))
      context.warn(
          marrow::formatted("view '{}': the borders are {} mm apart at the depth of the axis, but shafts are {} wide; "
                            "the views' pairs show different things",
                            lines.name(i), int(std::lround(width_mm)), range(possible)));
    metrics.items.push_back({lines.name(i) + "_width_mm", width_mm, "mm"});
    metrics.items.push_back({lines.name(i) + "_magnification", lines[i].width_mm / width_mm, ""});
  }
  return metrics;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("evaluate.shaft_width", shaft_width)
      .summary(
          "Outer diameter of the shaft from the planes through its borders in two views or more, without an assumed "
          "magnification")
      .in("lines", "borders of the shaft in each view", marrow::over("view"))
      .in("views", "X-ray views; only their cameras are used", marrow::over("view"))
      .out("metrics",
           "for each view, the diameter in the middle of its borders, and the magnification there relative to the "
           "depth at which the borders' own width was taken; gives a warning if no shaft has this diameter")
      .figures({"*_width_mm", "*_magnification"})
      .option("width_mm", &Options::width_mm,
              "mean outer diameters of the shaft, one for each direction from which the bone may be seen; empty: those "
              "of a femur, 15 to 55 mm")
      .option("width_deviation_mm", &Options::width_deviation_mm, "standard deviations of width_mm")
      .relation(marrow::same_length({"width_mm", "width_deviation_mm"}));
}
