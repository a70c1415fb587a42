// SPDX-License-Identifier: Apache-2.0
// The shaft's outer diameter from two views or more. Planes through the X-ray sources and the borders touch the bone;
// where its axis lies is known from the planes midway, so the diameter needs no guess of the magnification.
#include <cmath>
#include <marrow/plugin.hpp>

#include "marrow/toolbox/shaft/axis.hpp"
#include "marrow/toolbox/shaft/widths.hpp"

namespace {

using marrow::LineSegment, marrow::List, marrow::ShaftLines, marrow::View, marrow::shaft::Axis;

struct Options {
  std::vector<double> width_mm, width_deviation_mm;
};

Eigen::Vector2d middle_of(const LineSegment& segment) { return 0.5 * (segment.from_px + segment.to_px); }

/// The point of the axis that is nearest to the ray through the middle of a pair.
Eigen::Vector3d point_in_middle(const Axis& axis, const marrow::Camera& camera, const ShaftLines& lines) {
  const Eigen::Vector3d ray = marrow::ray_direction(camera, 0.5 * (middle_of(lines.left) + middle_of(lines.right)));
  const Eigen::Vector3d across = ray - axis.direction * axis.direction.dot(ray),
                        from = marrow::source_position_mm(camera) - axis.point_mm;
  const double along_ray = -across.dot(from) / across.squaredNorm();
  return axis.nearest_to(marrow::source_position_mm(camera) + along_ray * ray);
}

/// Twice the mean distance of the axis from the planes through the borders, where the pair's middle is.
double diameter_mm(const Axis& axis, const marrow::Camera& camera, const ShaftLines& lines) {
  const Eigen::Vector3d point = point_in_middle(axis, camera, lines);
  double sum = 0;
  for (const LineSegment* border : {&lines.left, &lines.right}) {
    const marrow::Plane plane =
        marrow::back_project_line(camera, border->from_px.homogeneous().cross(border->to_px.homogeneous()));
    sum += std::abs(plane.normal.dot(point) - plane.offset_mm);
  }
  return sum;
}

std::optional<marrow::Metrics> shaft_width(const List<ShaftLines>& lines, const List<View>& views,
                                           const Options& options, marrow::Context& context) {
  const marrow::shaft::Widths widths(options.width_mm, options.width_deviation_mm, 0);
  std::vector<const View*> seen;
  std::vector<marrow::Plane> planes;
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const View* view = views.find(lines.name(i));
    if (!view)
      throw marrow::Error("there are shaft lines of a view '" + lines.name(i) +
                          "', but no such view; wire the views that the lines were found in");
    marrow::check_camera(view->camera, "view '" + view->name + "'");
    seen.push_back(view);
    planes.push_back(marrow::shaft::bisecting_plane(view->camera, lines[i].left, lines[i].right));
  }
  if (planes.size() < 2) {
    context.warn(
        "there are shaft lines of one view alone: where the bone lies between source and detector, and so its "
        "diameter, is not known");
    return std::nullopt;
  }
  const Axis axis = marrow::shaft::axis_of_planes(planes);
  marrow::Metrics metrics;
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const double width_mm = diameter_mm(axis, seen[i]->camera, lines[i]);
    if (!widths.is_possible(width_mm))
      context.warn("view '" + lines.name(i) + "': the borders are " + std::to_string(int(std::lround(width_mm))) +
                   " mm apart at the depth where the views have the axis, which is no shaft's width (" +
                   widths.range() + "); one view's pair is another thing than the other's");
    metrics.items.push_back({lines.name(i) + "_width_mm", width_mm, "mm"});
    metrics.items.push_back({lines.name(i) + "_magnification", lines[i].width_mm / width_mm, ""});
  }
  return metrics;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("evaluate.shaft_width", shaft_width)
      .summary(
          "Outer diameter of the shaft by the planes that touch it in two views or more, without a guess of the "
          "magnification")
      .in("lines", "borders of the shaft in each view", marrow::over("view"))
      .in("views", "X-ray views, for their cameras", marrow::over("view"))
      .out("metrics",
           "for each view the diameter in the middle of its borders, and the magnification there relative to the "
           "isocentre; a warning where it is no shaft's diameter")
      .option("width_mm", &Options::width_mm,
              "mean outer diameters, one for each direction from which the bone may be seen; none: a femur's, by level")
      .option("width_deviation_mm", &Options::width_deviation_mm, "their standard deviations")
      .relation(marrow::same_length({"width_mm", "width_deviation_mm"}));
}
