// SPDX-License-Identifier: Apache-2.0
// Compares the borders of the shaft found in a view with the true outline: that of the model at its true pose, along
// the same part of the shaft in the same view.
#include <algorithm>
#include <cmath>
#include <marrow/plugin.hpp>

#include "true_borders.hpp"

namespace {

using marrow::LineSegment, marrow::List, marrow::Mesh, marrow::ShaftLines, marrow::Truth, marrow::View;

struct Options {
  double tolerance_mm = 1.0;
};

/// A segment of the image in mm at the bone, on a plane parallel to the detector. Pixels may not be square.
struct Segment {
  Eigen::Vector2d from_mm, to_mm;
  Eigen::Vector2d way() const { return (to_mm - from_mm).normalized(); }
  /// How far a point is to the right of the segment.
  double across_mm(const Eigen::Vector2d& point_mm) const {
    return way().x() * (point_mm - from_mm).y() - way().y() * (point_mm - from_mm).x();
  }
};

Segment at_bone(const LineSegment& segment, const View& view, const Eigen::Vector3d& bone_mm) {
  return {marrow::offset_at_mm(view.camera, bone_mm, segment.from_px),
          marrow::offset_at_mm(view.camera, bone_mm, segment.to_px)};
}

/// Difference of two segments with the same length and direction.
struct Difference {
  double angle_deg = 0;               ///< signed
  double middle_mm = 0, ends_mm = 0;  ///< distances from the true line: signed in the middle, largest at the ends
};

Difference difference(const Segment& found, const Segment& truth) {
  const Eigen::Vector2d way = truth.way(), own = found.way();
  const double from = truth.across_mm(found.from_mm), to = truth.across_mm(found.to_mm);
  return {marrow::degrees(std::atan2(way.x() * own.y() - way.y() * own.x(), way.dot(own))), 0.5 * (from + to),
          std::max(std::abs(from), std::abs(to))};
}

struct Comparison {
  Difference left, right, middle;
  double width_mm = 0;   ///< of the true outline, in the middle
  double length_mm = 0;  ///< of the pair found
  double worst_mm() const { return std::max(left.ends_mm, right.ends_mm); }
};

Segment middle_of(const Segment& one, const Segment& other) {
  return {0.5 * (one.from_mm + other.from_mm), 0.5 * (one.to_mm + other.to_mm)};
}

Comparison compared(const ShaftLines& lines, const true_borders::Borders& truth, const View& view) {
  const auto segment = [&](const LineSegment& one) { return at_bone(one, view, truth.middle_mm); };
  const Segment left = segment(lines.left), right = segment(lines.right), true_left = segment(truth.left),
                true_right = segment(truth.right), axis = middle_of(true_left, true_right);
  const auto off_axis_mm = [&](const Segment& one) { return axis.across_mm(0.5 * (one.from_mm + one.to_mm)); };
  return {difference(left, true_left), difference(right, true_right), difference(middle_of(left, right), axis),
          off_axis_mm(true_right) - off_axis_mm(true_left), (left.to_mm - left.from_mm).norm()};
}

/// Compares with the fragment whose outline is nearest. Nothing if no fragment lies along the pair of borders.
std::optional<Comparison> compare(const ShaftLines& lines, const View& view, const List<Mesh>& models,
                                  const List<Truth>& truths, double tolerance_mm) {
  std::optional<Comparison> best;
  for (std::size_t i = 0; i < models.size(); ++i) {
    const Truth* truth = truths.find(models.name(i));
    if (!truth) continue;
    const auto borders =
        true_borders::borders_beside(lines, models[i], truth->world_from_model, view.camera, tolerance_mm);
    if (!borders) continue;
    const Comparison one = compared(lines, *borders, view);
    if (!best || one.worst_mm() < best->worst_mm()) best = one;
  }
  return best;
}

std::optional<marrow::Metrics> shaft_lines(const ShaftLines& lines, const View& view, const List<Mesh>& models,
                                           const List<Truth>& truths, const Options& options,
                                           marrow::Context& context) {
  marrow::check_camera(view.camera, "view '" + view.name + "'");
  const std::optional<Comparison> best = compare(lines, view, models, truths, options.tolerance_mm);
  if (!best) {
    context.warn("view '" + view.name +
                 "': no fragment of known pose lies where the pair of borders was found, so there is nothing to "
                 "compare it with");
    return std::nullopt;
  }
  const Comparison& found = *best;
  const auto larger = [](double a, double b) { return std::max(std::abs(a), std::abs(b)); };
  marrow::Metrics metrics;
  metrics.items = {{"border_angle_deg", larger(found.left.angle_deg, found.right.angle_deg), "deg"},
                   {"border_offset_mm", larger(found.left.middle_mm, found.right.middle_mm), "mm"},
                   {"worst_mm", found.worst_mm(), "mm"},
                   {"axis_angle_deg", std::abs(found.middle.angle_deg), "deg"},
                   {"axis_offset_mm", std::abs(found.middle.middle_mm), "mm"},
                   {"width_error_mm", found.right.middle_mm - found.left.middle_mm, "mm"},
                   {"true_width_mm", found.width_mm, "mm"},
                   {"length_mm", found.length_mm, "mm"},
                   {"log_likelihood", lines.log_likelihood, ""}};
  return metrics;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("evaluate.shaft_lines", shaft_lines)
      .summary(
          "Errors of the shaft's borders in a view, against lines fitted to the true outline along the same part of "
          "the shaft")
      .in("lines", "borders found in the view")
      .in("view", "X-ray view; only its camera is used")
      .in("models", "surface of each fragment", marrow::over("fragment"))
      .in("truths", "exact pose of each fragment", marrow::over("fragment"))
      .out("metrics",
           "all lengths in mm at the depth of the true outline; of the two borders, the larger angle to the true "
           "border and the larger distance from it in the middle; the largest distance at an end (more than a few mm "
           "means a wrong pair); angle and distance of the axis, the line midway between the borders; found width "
           "minus true width (negative if the edges lie inside the outline); true width; length; log-likelihood from "
           "the shaft node")
      .figures({"border_angle_deg", "border_offset_mm", "worst_mm", "axis_angle_deg", "axis_offset_mm",
                "width_error_mm", "true_width_mm", "length_mm", "log_likelihood"})
      .option("tolerance_mm", &Options::tolerance_mm,
              "largest distance, in mm at the bone, of a silhouette point from the line fitted to the outline",
              marrow::at_least(0.01));
}
