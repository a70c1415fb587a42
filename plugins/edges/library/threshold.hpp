// SPDX-License-Identifier: Apache-2.0
#pragma once
// The common part of the classical edge extractors: one threshold on the gradient's magnitude, and edges one pixel
// wide. The threshold is the median of a window plus a multiple of the noise, as for Canny's detector here. So one
// setting serves bright and dark parts, 8 and 16 bits, and the smooth slope of a round thigh, where noise makes ridges.
#include <marrow/plugin.hpp>

#include "marrow/edges/gradient.hpp"

namespace marrow::edges {

/// See the help texts in declare_thresholds(). `sigma_px`: standard deviation of the smoothing Gaussian.
struct ThresholdOptions {
  double sigma_px = 1.5;
  bool logarithm = true;
  int window_px = 80;
  double threshold = 4;
};

/// Edges at the usable pixels where the gradient is above the threshold and the edge to which `way` leads passes
/// through the pixel or just beside it.
EdgeMap edges_above_noise(const Prepared& image, const Gradient& gradient, const ThresholdOptions& options,
                          const WayToEdge& way);

/// Declares the ports and all options except sigma_px.
template <class Builder>
auto& declare_thresholds(Builder& node) {
  return node.in("view", "X-ray view")
      .out("edges", "edge pixels at sub-pixel positions")
      .option("logarithm", &ThresholdOptions::logarithm, "find edges of the attenuation (logarithm of the grey value)")
      .option("window_px", &ThresholdOptions::window_px,
              "side of the window of the median, reduced to an odd multiple of 16", at_least(16))
      .option("threshold", &ThresholdOptions::threshold,
              "least magnitude above the window's median, in standard deviations of the noise", at_least(0));
}

// Statistics of a moving window. They are computed for blocks of 16 x 16 pixels and interpolated between block centres.

/// Percentiles of the gradient's magnitude over the usable pixels of a window around each block. For each percentage a
/// CV_32F matrix with one value per block of 16 x 16 pixels; 0 where the window has no usable pixel. The window's side
/// is the largest odd number of blocks within `window_px`, at least one. `usable` is CV_8U, non-zero at usable pixels.
std::array<cv::Mat, 3> window_percentiles(const Gradient& gradient, const cv::Mat& usable, int window_px,
                                          const std::array<double, 3>& percents);

/// The noise of a component of the gradient (NoiseLevel), one CV_32F value per block.
cv::Mat block_noise(const Prepared& image, const Gradient& gradient);

/// Bilinear interpolation between the centres of blocks, along row `v` of the image. row.size() is the image's width.
void interpolate_row(const cv::Mat& blocks, int v, std::vector<float>& row);

}  // namespace marrow::edges
