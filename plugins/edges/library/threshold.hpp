// SPDX-License-Identifier: Apache-2.0
#pragma once
// The common part of the classical edge extractors: one threshold on the gradient's magnitude, and edges one pixel
// wide. The threshold is the median of a window plus a multiple of the noise, as for Canny's detector here. So one
// setting serves bright and dark parts, 8 and 16 bits, and the smooth slope of a round thigh, where noise makes ridges.
#include <marrow/plugin.hpp>

#include "marrow/edges/gradient.hpp"
#include "marrow/edges/refine.hpp"

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

}  // namespace marrow::edges
