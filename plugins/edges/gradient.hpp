// SPDX-License-Identifier: Apache-2.0
#pragma once
// What the edge detectors share: the image made ready, its gradient, and the noise in that gradient.
#include <cmath>
#include <marrow/domain/camera.hpp>
#include <opencv2/core.hpp>
#include <utility>
#include <vector>

namespace marrow::edges {

/// The values whose edges are sought. With `logarithm` they are ln(grey value), so that edges are steps of attenuation,
/// equally high under a bright and a dark part of the exposure.
struct Prepared {
  cv::Mat values;  ///< CV_32F
  cv::Mat usable;  ///< CV_8U, non-zero where edges may be reported
  bool logarithm = false;
  bool whole_numbers = false;  ///< the image has whole grey values, and so at least their rounding noise
  float range = 0;             ///< largest less smallest grey value

  /// Change of the value for one grey value.
  float slope(float value) const { return logarithm ? std::exp(-value) : 1.0f; }
};

/// Checks the view and prepares it. Not usable are what View::mask excludes, black corners left by a round collimator
/// (found where at least three corners are black), each with a margin of 3 sigma, and the outermost 3 sigma of the
/// image. Throws Error for an image that is constant, holds NaN or infinity, or has no usable pixel.
Prepared prepare(const View& view, double sigma_px, bool logarithm);

/// Derivatives of the image smoothed by a Gaussian, per pixel; CV_32F.
struct Gradient {
  cv::Mat du, dv, magnitude;
};
Gradient gaussian_gradient(const cv::Mat& values, double sigma_px);

/// The standard deviation that noise alone gives to a component of the gradient, as a function of the value: X-ray
/// noise depends on brightness. Measured as the median absolute deviation in blocks of 16 x 16 pixels, of which those
/// of equal brightness that vary least are believed.
class NoiseLevel {
 public:
  NoiseLevel(const Prepared& image, const Gradient& gradient, double sigma_px);
  float at(float value) const;

 private:
  std::vector<std::pair<float, float>> noise_of_value_;  ///< ascending values
};

}  // namespace marrow::edges
