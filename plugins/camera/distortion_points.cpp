// SPDX-License-Identifier: Apache-2.0
// A distortion from points whose places in the straight image another program found.
#include <marrow/plugin.hpp>

#include "marrow/camera/distortion_report.hpp"

namespace {

using namespace marrow;
using namespace marrow::distortion;

struct Options : camera::DistortionOptions {
  double area_margin_px = 0;
};

struct Result {
  Distortion distortion;
  PlatePoints points;
  Metrics metrics;
  Picture picture;
};

Result distortion_points(const PlatePoints& points, const Image* image, const Options& options, Context& context) {
  FitOptions fit_options = camera::fit_options(options);
  fit_options.area_margin_px = options.area_margin_px;
  const Fit fit = fit_distortion(points, fit_options);
  camera::warn_of_fit(fit, context);
  return {fit.distortion, fit.points, camera::figures_of(fit),
          camera::picture_of(image ? *image : Image(), fit, options)};
}

}  // namespace

MARROW_PLUGIN(plugin) {
  auto node = plugin.node("camera.distortion_points", distortion_points);
  node.summary("Distortion from points that are known in the straight and in the original image, such as XMALab's grid")
      .in("points", "where each point was seen, and where the straight image shows it")
      .in("image", "the image of the points, for the picture")
      .out("distortion", &Result::distortion, "how the image is bent, and where that was measured")
      .out("points", &Result::points, "the points; those that do not fit are not used")
      .out("metrics", &Result::metrics, "residuals of the fit, turn and pincushion")
      .figures({"points", "outliers", "degree", "local", "residual", "validated", "validated_degree_*", "turn",
                "pincushion", "rim"})
      .out("picture", &Result::picture, "the points, their residuals and the measured area")
      .option("area_margin_px", &Options::area_margin_px, "the measured area reaches this far beyond the points",
              at_least(0));
  camera::declare_fit_options<Options>(node);
}
