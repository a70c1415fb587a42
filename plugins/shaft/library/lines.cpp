// SPDX-License-Identifier: Apache-2.0
#include "marrow/shaft/lines.hpp"

#include <algorithm>
#include <cmath>
#include <marrow/base/error.hpp>
#include <marrow/domain/camera.hpp>
#include <tuple>

#include "marrow/base/number_text.hpp"

namespace marrow::shaft {
namespace {

void check_inputs(const EdgeMap& edges, const View& view) {
  check_view(view);
  const std::string what = "view '" + view.name + "': ";
  const int type = view.image.pixels.type();
  if (type != CV_8UC1 && type != CV_16UC1 && type != CV_32FC1)
    throw Error(what + "the image must have one channel of 8 or 16 bit whole numbers or 32 bit floats");
  if (edges.width_px != view.camera.width_px || edges.height_px != view.camera.height_px)
    throw Error(formatted("{}the edge map is for {} x {} pixels, the view has {} x {}; wire the edges of this view",
                          what, edges.width_px, edges.height_px, view.camera.width_px, view.camera.height_px));
  if (edges.pixels.empty())
    throw Error(what +
                "the edge map is empty, so there is no shaft in it; look at the image, and lower the thresholds of the "
                "edge detector");
  for (const EdgePixel& edge : edges.pixels)
    if (!std::isfinite(edge.u_px) || !std::isfinite(edge.v_px) || !std::isfinite(edge.direction_u) ||
        !std::isfinite(edge.direction_v))
      throw Error(what + "the edge map holds numbers that are not finite (NaN or infinity); look at the edge detector");
}

/// A point on the central ray of a view, at the depth of the shaft.
Eigen::Vector3d place_of_shaft(const View& view, const List<View>* views, const LineOptions& options,
                               Context& context) {
  constexpr double kUsual_mm = 600;
  if (!(options.source_to_shaft_mm > 0) && views)
    if (const auto meeting_mm = meeting_point_mm(*views)) return *meeting_mm;
  if (!(options.source_to_shaft_mm > 0))
    context.warn("view '" + view.name +
                 "': how far the shaft is from the X-ray source is not known; 600 mm are assumed, and all its lengths "
                 "in mm depend on this. Wire 'views' with two views or more, or set source_to_shaft_mm");
  const double depth_mm = options.source_to_shaft_mm > 0 ? options.source_to_shaft_mm : kUsual_mm;
  return source_position_mm(view.camera) + depth_mm * view.camera.camera_from_world.rotation.row(2).transpose();
}

/// Whether two borders are the same line: similar directions, and close to each other at the middle of the image.
bool same_line(const Border& one, const Border& other, const Eigen::Vector2d& middle, double tolerance_px) {
  const Eigen::Vector2d direction = along(one);
  const double s = direction.dot(middle);
  return other.normal.dot(one.normal) > std::cos(radians(1)) &&
         (point_at(other, direction, s) - point_at(one, direction, s)).norm() < tolerance_px;
}

}  // namespace

double Scale::across_mm(const Eigen::Vector2d& offset_px, const Eigen::Vector2d& along_px) const {
  const Eigen::Vector2d offset = mm_from_px * offset_px, along = (mm_from_px * along_px).normalized();
  return std::abs(along.x() * offset.y() - along.y() * offset.x());
}

Scale checked_scale(const EdgeMap& edges, const View& view, const List<View>* views, const LineOptions& options,
                    Context& context) {
  check_inputs(edges, view);
  const Eigen::Vector3d shaft_mm = place_of_shaft(view, views, options, context);
  Scale scale;
  scale.pixel_mm = pixel_size_at_mm(view.camera, shaft_mm);
  scale.mm_from_px.col(0) = offset_at_mm(view.camera, shaft_mm, Eigen::Vector2d::UnitX());
  scale.mm_from_px.col(1) = offset_at_mm(view.camera, shaft_mm, Eigen::Vector2d::UnitY());
  scale.min_length_px = options.min_length_mm / scale.pixel_mm;
  scale.gap_px = options.gap_mm / scale.pixel_mm;
  scale.support = {options.tolerance_mm / scale.pixel_mm, std::cos(radians(15))};
  return scale;
}

std::vector<Border> supported_lines(const EdgeMap& edges, const std::vector<Border>& candidates, const Scale& scale,
                                    const LineOptions& options) {
  const Eigen::Vector2d middle(0.5 * edges.width_px, 0.5 * edges.height_px);
  std::vector<Border> borders;
  for (Border border : candidates) {
    if (int(borders.size()) == options.lines) break;
    border.pixels = 1;
    for (int round = 0; round < 2 && border.pixels > 0; ++round) {
      Stretch run;
      run.along = along(border);
      std::tie(run.from, run.to) =
          longest_run(supported_positions(edges, border, scale.support, run.along), scale.gap_px);
      border = run.length() < 0.5 * scale.min_length_px ? Border{} : refit(edges, border, scale.support, run, 2);
    }
    const auto same = [&](const Border& other) {
      return same_line(border, other, middle, 0.3 * scale.support.tolerance_px);
    };
    if (border.pixels > 0 && std::none_of(borders.begin(), borders.end(), same)) borders.push_back(border);
  }
  return borders;
}

}  // namespace marrow::shaft
