// SPDX-License-Identifier: Apache-2.0
#pragma once
// What the classical extractors share: one threshold on the gradient's magnitude, and edges one pixel wide. The
// threshold counts above the median of a window and in multiples of the noise, as Canny's do here, so that it serves
// bright and dark parts, 8 and 16 bits, and the smooth slope of a round thigh, on which noise makes ridges.
#include <marrow/plugin.hpp>

#include "marrow/toolbox/image/gradient.hpp"
#include "marrow/toolbox/image/refine.hpp"

namespace marrow::image {

struct ThresholdOptions {
  double sigma_px = 1.5;
  bool logarithm = true;
  int window_px = 80;
  double threshold = 4;
};

/// Edges where the gradient is steep enough and the edge, which `way` leads to, passes through the pixel or just beside
/// it.
EdgeMap edges_above_noise(const Prepared& image, const Gradient& gradient, const ThresholdOptions& options,
                          const WayToEdge& way);

/// Edges by a mask of few pixels (Roberts, Prewitt, Sobel), laid on the smoothed image: the ridge of the magnitude.
EdgeMap mask_edges(const View& view, const ThresholdOptions& options, const Kernel& mask);

/// The options, but for the Gaussian's width.
template <class Builder>
auto& declare_threshold_options(Builder& node) {
  return node
      .option("logarithm", &ThresholdOptions::logarithm, "seek edges of the attenuation (logarithm of the grey value)")
      .option("window_px", &ThresholdOptions::window_px,
              "side of the window of the median, in effect an odd multiple of 16", at_least(16))
      .option("threshold", &ThresholdOptions::threshold,
              "least magnitude above the window's median, in standard deviations of the noise", at_least(0));
}

}  // namespace marrow::image
