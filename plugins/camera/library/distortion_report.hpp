// SPDX-License-Identifier: Apache-2.0
#pragma once
// What nodes that measure a distortion share: options of the fit, figures, warnings and the picture.
#include <string>

#include "marrow/domain/pose.hpp"
#include "marrow/runtime/node/context.hpp"
#include "marrow/toolbox/distortion/fit.hpp"

namespace marrow::camera {

struct DistortionOptions {
  std::string fit = "automatic";
  int lowest_degree = 3, highest_degree = 7;
  double outlier_deviations = 5;
  double residual_scale = 50;
  int size_px = 800;
};

distortion::FitOptions fit_options(const DistortionOptions& options);

/// Numbers of points, residuals, the degree, and how the image is bent.
Metrics figures_of(const distortion::Fit& fit);

/// Warns of many outliers, and of a fit that is much worse where it did not see the points.
void warn_of_fit(const distortion::Fit& fit, const Context& context);

/// The image with the points, their residuals, the points left out and the border of the measured area. A fit of points
/// without an image is drawn on grey.
Picture picture_of(const Image& image, const distortion::Fit& fit, const DistortionOptions& options);

/// Declares these options.
template <class Options, class Node>
void declare_fit_options(Node& node) {
  node.option("fit", &Options::fit,
              "polynomial, or local: a polynomial and what remains near each place; automatic: local if it lowers the "
              "residual of points that the fit did not see by more than 5 %",
              one_of({"automatic", "polynomial", "local"}))
      .option("lowest_degree", &Options::lowest_degree, "lowest degree of the polynomial that is tried", at_least(1),
              at_most(7))
      .option("highest_degree", &Options::highest_degree, "highest degree of the polynomial that is tried", at_least(1),
              at_most(7))
      .relation(not_above("lowest_degree", "highest_degree"))
      .option("outlier_deviations", &Options::outlier_deviations,
              "points with a residual of more than this many standard deviations are left out", at_least(3), unit("1"))
      .option("residual_scale", &Options::residual_scale, "residuals are drawn this many times longer", at_least(1),
              unit("1"))
      .option("size_px", &Options::size_px, "longer side of the picture", at_least(100), at_most(4096));
}

}  // namespace marrow::camera
