// SPDX-License-Identifier: Apache-2.0
// The distortion of an image intensifier from an image of a planar plate with a regular grid of dots or holes.
#include <algorithm>
#include <cmath>
#include <marrow/plugin.hpp>

#include "marrow/camera/distortion_report.hpp"
#include "marrow/toolbox/distortion/plate.hpp"

namespace {

using namespace marrow;
using namespace marrow::distortion;

struct Options : camera::DistortionOptions {
  double spacing_mm = 0;
  std::string grid = "automatic", dots = "automatic", straight = "automatic";
  double dot_px = 0;
};

struct Result {
  Distortion distortion;
  PlatePoints points;
  Metrics metrics;
  Picture picture;
};

PlateImage found_plate(const Image& image, const Options& options) {
  PlateSearch search;
  search.dot_px = options.dot_px;
  if (options.grid != "automatic") search.grid = options.grid == "square" ? Pattern::square : Pattern::hexagonal;
  if (options.dots != "automatic") search.is_bright = options.dots == "bright";
  return find_plate(image, search, 3 * terms_of(options.lowest_degree));
}

Straight straight_of(const std::string& name) {
  return name == "automatic"    ? Straight::automatic
         : name == "similarity" ? Straight::similarity
         : name == "affine"     ? Straight::affine
                                : Straight::homography;
}

struct Coverage {
  double image = 0, field = 0, area = 0;
};

/// The shares of image, field and measured area that dots cover: what lies within one spacing of a dot.
Coverage coverage_of(const Image& image, const Fit& fit, double spacing) {
  std::vector<Eigen::Vector2d> seen, ideal;
  for (std::size_t i = 0; i < fit.points.used.size(); ++i)
    if (fit.points.used[i]) {
      seen.push_back(fit.points.seen_px[i]);
      ideal.push_back(fit.points.ideal_px[i]);
    }
  const cv::Mat1b whole(image.pixels.size(), std::uint8_t(255));
  cv::Mat1b area(image.pixels.size(), std::uint8_t(0));
  for (int v = 0; v < area.rows; ++v)
    for (int u = 0; u < area.cols; ++u)
      if (is_measured(fit.distortion, {u, v})) area(v, u) = 255;
  return {covered_share(seen, spacing, whole), covered_share(seen, spacing, field_of(image, 2 * spacing)),
          covered_share(ideal, spacing, area)};
}

/// Says what is known of the plate's tilt.
void tell_tilt(const StraightPlate& straight, const Options& options, Context& context) {
  constexpr double kDoubtful_px = 0.25;
  const PlateTilt& tilt = straight.tilt;
  if (tilt.places.empty()) return;
  const std::string moved = formatted("the plate's tilt moves the image's rim by {:.2f} px, with a deviation of {:.2f}",
                                      tilt.perspective_px, tilt.deviation_px);
  const bool is_doubtful = 2 * tilt.deviation_px > kDoubtful_px;
  if (straight.is_tilted && is_doubtful)
    context.warn(moved +
                 ", and is taken out of the distortion; something bends the image locally, so fix the plate on "
                 "the intensifier's face");
  else if (straight.is_tilted)
    context.info(moved +
                 ", and is taken out of the distortion; if the plate is parallel to the detector, set "
                 "straight=similarity");
  else if (options.straight == "similarity" && tilt.is_certain() && tilt.perspective_px > kDoubtful_px)
    context.warn(moved + "; it becomes a part of the distortion unless straight=automatic");
  else if (options.straight == "automatic" && is_doubtful)
    context.warn(moved +
                 ", which the distortion hides, so the plate is taken as parallel to the detector: fix it on "
                 "the intensifier's face");
}

void warn_of_plate(const Coverage& coverage, const StraightPlate& straight, const Options& options, Context& context) {
  if (coverage.field < 0.8)
    context.warn(
        formatted("the dots cover {:.0f} % of the field; views are masked out where none were near, so show "
                  "the plate over the whole field",
                  100 * coverage.field));
  if (coverage.area < 0.9)
    context.warn(
        formatted("{:.0f} % of the measured area has no dots nearby; there the distortion is only "
                  "interpolated from afar",
                  100 * (1 - coverage.area)));
  if (!straight.is_tilted && options.straight != "affine" && options.straight != "homography" &&
      straight.stretch > 1.01)
    context.warn(
        formatted("the middle of the image is {:.1f} % longer along one direction than along the other; if "
                  "the plate was tilted, and pixels are square, set straight=homography",
                  100 * (straight.stretch - 1)));
}

Result distortion_plate(const Image& image, const Options& options, Context& context) {
  const PlateImage plate = found_plate(image, options);
  context.check_cancelled();
  const StraightPlate straight = straight_plate(plate, straight_of(options.straight), image.width(), image.height());
  FitOptions fit_options = camera::fit_options(options);
  fit_options.area_margin_px = plate.dot_px;  // dots that the border cuts are left out
  const Fit fit = fit_distortion(straight.points, fit_options);
  const Coverage coverage = coverage_of(image, fit, straight.pixels_per_spacing);
  camera::warn_of_fit(fit, context);
  warn_of_plate(coverage, straight, options, context);
  tell_tilt(straight, options, context);
  Metrics metrics = camera::figures_of(fit);
  const auto add = [&](const std::string& name, double value, const std::string& unit) {
    metrics.items.push_back({name, value, unit});
  };
  add("coverage", 100 * coverage.image, "%");
  add("field_coverage", 100 * coverage.field, "%");
  add("area_coverage", 100 * coverage.area, "%");
  add("stretch", 100 * (straight.stretch - 1), "%");
  if (!straight.tilt.places.empty()) {
    add("perspective", straight.tilt.perspective_px, "px");
    add("perspective_deviation", straight.tilt.deviation_px, "px");
  }
  add("spacing", straight.pixels_per_spacing, "px");
  add("dot", plate.dot_px, "px");
  if (options.spacing_mm > 0) add("pixel", options.spacing_mm / straight.pixels_per_spacing, "mm");
  return {fit.distortion, fit.points, metrics, camera::picture_of(image, fit, options)};
}

}  // namespace

MARROW_PLUGIN(plugin) {
  auto node = plugin.node("camera.distortion_plate", distortion_plate);
  node.summary(
          "Distortion of an image intensifier, S-shape included, from an image of a planar plate with a grid of dots "
          "or "
          "holes")
      .in("image", "image of the plate, not corrected for distortion")
      .out("distortion", &Result::distortion, "how the image is bent, and where that was measured")
      .out("points", &Result::points, "the dots: where each was seen, and where the straight image shows it")
      .out("metrics", &Result::metrics, "residuals of the fit, turn, pincushion and coverage")
      .figures({"points", "outliers", "degree", "local", "residual", "validated", "validated_degree_*", "turn",
                "pincushion", "rim", "coverage", "field_coverage", "area_coverage", "stretch", "perspective",
                "perspective_deviation", "spacing", "dot", "pixel"})
      .out("picture", &Result::picture, "the image with the dots, their residuals and the measured area")
      .option("dot_spacing_mm", &Options::spacing_mm,
              "distance between neighbouring dots on the plate, for the size of a pixel there; 0: not known",
              at_least(0))
      .option("grid", &Options::grid, "grid of the plate; automatic: the one of which more dots are found",
              one_of({"automatic", "square", "hexagonal"}))
      .option("dots", &Options::dots, "bright holes or dark dots", one_of({"automatic", "bright", "dark"}))
      .option("dot_px", &Options::dot_px, "diameter of a dot in the image; 0: sizes from 2 px on are tried",
              at_least(0), at_most(500))
      .option(
          "straight", &Options::straight,
          "what the straight image has in common with the middle of the original: its size and turn (similarity: "
          "the plate is parallel to the detector), also its stretch (affine), or the perspective of the whole image "
          "(homography). automatic: as similarity, without the perspective of a tilted plate where a distortion that "
          "is round about one point tells it for certain",
          one_of({"automatic", "similarity", "affine", "homography"}));
  camera::declare_fit_options<Options>(node);
}
