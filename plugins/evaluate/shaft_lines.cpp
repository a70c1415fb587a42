// SPDX-License-Identifier: Apache-2.0
// Compares the borders of the shaft found in a view with those of the true outline. The true outline is that of the
// model at its true pose, along the same part of the shaft in the same view.
#include <algorithm>
#include <cmath>
#include <marrow/plugin.hpp>

#include "true_borders.hpp"

namespace {

using marrow::LineSegment, marrow::List, marrow::Mesh, marrow::ShaftLines, marrow::Truth, marrow::View;

struct Options {
  double tolerance_mm = 1.0;
};

/// Difference of two segments with the same length and direction.
struct Difference {
  double angle_deg = 0;               ///< signed
  double middle_px = 0, ends_px = 0;  ///< distances from the true line: signed in the middle, largest at the ends
};

Difference difference(const LineSegment& found, const LineSegment& truth) {
  const Eigen::Vector2d way = (truth.to_px - truth.from_px).normalized(),
                        own = (found.to_px - found.from_px).normalized();
  const auto across = [&](const Eigen::Vector2d& p) {
    return way.x() * (p - truth.from_px).y() - way.y() * (p - truth.from_px).x();
  };
  const double from = across(found.from_px), to = across(found.to_px);
  return {marrow::degrees(std::atan2(way.x() * own.y() - way.y() * own.x(), way.dot(own))), 0.5 * (from + to),
          std::max(std::abs(from), std::abs(to))};
}

struct Comparison {
  std::string fragment;
  Difference left, right, middle;
  double width_px = 0;  ///< width of the true outline
  double worst_px() const { return std::max(left.ends_px, right.ends_px); }
};

LineSegment middle_of(const LineSegment& one, const LineSegment& other) {
  return {0.5 * (one.from_px + other.from_px), 0.5 * (one.to_px + other.to_px)};
}

/// Compares with the fragment whose outline is nearest. Nothing if no fragment lies along the pair of borders.
std::optional<Comparison> compare(const ShaftLines& lines, const View& view, const List<Mesh>& models,
                                  const List<Truth>& truths, double tolerance_px) {
  std::optional<Comparison> best;
  for (std::size_t i = 0; i < models.size(); ++i) {
    const Truth* truth = truths.find(models.name(i));
    if (!truth) continue;
    const auto borders =
        true_borders::borders_beside(lines, models[i], truth->world_from_model, view.camera, tolerance_px);
    if (!borders) continue;
    const Comparison one{models.name(i), difference(lines.left, borders->left), difference(lines.right, borders->right),
                         difference(middle_of(lines.left, lines.right), middle_of(borders->left, borders->right)),
                         borders->width_px};
    if (!best || one.worst_px() < best->worst_px()) best = one;
  }
  return best;
}

std::optional<marrow::Metrics> shaft_lines(const ShaftLines& lines, const View& view, const List<Mesh>& models,
                                           const List<Truth>& truths, const Options& options,
                                           marrow::Context& context) {
  marrow::check_camera(view.camera, "view '" + view.name + "'");
  const double pixel_mm = marrow::pixel_size_at_mm(view.camera, Eigen::Vector3d::Zero());
  if (!(pixel_mm > 0))
    throw marrow::Error("view '" + view.name +
                        "': the world's origin, the isocentre, does not lie in front of the X-ray source");
  const std::optional<Comparison> compared = compare(lines, view, models, truths, options.tolerance_mm / pixel_mm);
  if (!compared) {
    context.warn("view '" + view.name +
                 "': no fragment of known pose lies where the pair of borders was found, so there is nothing to "
                 "compare it with");
    return std::nullopt;
  }
  const Comparison& found = *compared;
  const auto larger = [](double a, double b) { return std::max(std::abs(a), std::abs(b)); };
  marrow::Metrics metrics;
  metrics.items = {{"border_angle_deg", larger(found.left.angle_deg, found.right.angle_deg), "deg"},
                   {"border_offset_mm", pixel_mm * larger(found.left.middle_px, found.right.middle_px), "mm"},
                   {"worst_mm", pixel_mm * found.worst_px(), "mm"},
                   {"axis_angle_deg", std::abs(found.middle.angle_deg), "deg"},
                   {"axis_offset_mm", pixel_mm * std::abs(found.middle.middle_px), "mm"},
                   {"width_error_mm", pixel_mm * (found.right.middle_px - found.left.middle_px), "mm"},
                   {"true_width_mm", pixel_mm * found.width_px, "mm"},
                   {"length_mm", pixel_mm * (lines.left.to_px - lines.left.from_px).norm(), "mm"},
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
      .out(
          "metrics",
          "all lengths in mm at the isocentre's depth; of the two borders, the larger angle to the true border and the "
          "larger distance from it in the middle; the largest distance at an end (more than a few mm means a wrong "
          "pair); angle and distance of the axis, the line midway between the borders; found width minus true width "
          "(negative if the edges lie inside the outline); true width; length; log-likelihood from the shaft node")
      .option("tolerance_mm", &Options::tolerance_mm,
              "largest distance, in mm at the isocentre, of a silhouette point from the line fitted to the outline",
              marrow::at_least(0.01));
}
