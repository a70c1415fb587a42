// SPDX-License-Identifier: Apache-2.0
// The classical masks for the gradient: central differences over 3 x 3 pixels, averaged across their direction with
// double weight in the middle by Sobel (Stanford Artificial Intelligence Project, 1968) and with equal weights by
// Prewitt (in: Picture Processing and Psychopictorics, 1970). Roberts (in: Optical and Electro-Optical Information
// Processing, 1965) takes the differences along the two diagonals of 2 x 2 pixels. Rotated by 45 degrees, these are the
// differences between the means of opposite sides.
#include "marrow/edges/threshold.hpp"

namespace {

using namespace marrow::edges;

struct MaskOptions : ThresholdOptions {
  std::string mask = "sobel";
};

Kernel kernel_of(const std::string& mask) {
  if (mask == "prewitt") return {{1 / 3.0f, 1 / 3.0f, 1 / 3.0f}, {-0.5f, 0, 0.5f}};
  if (mask == "roberts") return {{0.5f, 0.5f}, {-1, 1}};
  return {{0.25f, 0.5f, 0.25f}, {-0.5f, 0, 0.5f}};
}

/// Ridges of the gradient's magnitude in the smoothed image.
marrow::EdgeMap gradient_mask(const marrow::View& view, const MaskOptions& options, marrow::Context& context) {
  const Prepared image = prepare(view, std::max(1.0, options.sigma_px), options.logarithm, context);
  const Gradient gradient = gradient_of(image.values, smoothed_mask(kernel_of(options.mask), options.sigma_px));
  return edges_above_noise(image, gradient, options, [&](int u, int v) { return way_to_ridge(gradient, u, v); });
}

}  // namespace

MARROW_PLUGIN(plugin) {
  declare_thresholds(plugin.node("edges.gradient_mask", gradient_mask)
                         .summary("The mask of Sobel (1968), Prewitt (1970) or Roberts (1965) with thinning and one "
                                  "threshold, in multiples of the image's noise")
                         .option("mask", &MaskOptions::mask, "whose mask: 3 x 3 pixels, roberts 2 x 2",
                                 marrow::one_of({"sobel", "prewitt", "roberts"}))
                         .option("sigma_px", &MaskOptions::sigma_px,
                                 "standard deviation of the Gaussian that smooths the image first; 0: no smoothing",
                                 marrow::at_least(0), marrow::at_most(10)));
}
