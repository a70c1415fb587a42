// SPDX-License-Identifier: Apache-2.0
#pragma once
// What the edge detectors share: the image made ready, its gradient, and the noise in that gradient.
#include <cmath>
#include <marrow/domain/camera.hpp>
#include <opencv2/core.hpp>
#include <utility>
#include <vector>

namespace marrow::image {

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

/// Checks the view and prepares it; usable.hpp says which pixels are usable. Throws Error for an image that is
/// constant, holds NaN or infinity, or has no usable pixel.
Prepared prepare(const View& view, double sigma_px, bool logarithm);

/// A separable derivative: along one axis it derives, along the other it smooths. Both have the same number of weights;
/// of an even number the derivative lies half a pixel right of and below its pixel.
struct Kernel {
  std::vector<float> smooth, derive;
};
Kernel gaussian_kernel(double sigma_px, double reach = 3);  // ends at so many sigma
/// A mask of few pixels on the image smoothed by a Gaussian; sigma 0: the mask itself.
Kernel smoothed_mask(const Kernel& mask, double sigma_px);

/// Derivatives of the image, per pixel; CV_32F.
struct Gradient {
  cv::Mat du, dv, magnitude;
  double noise_gain = 1;  ///< deviation of a component for white noise of deviation 1 in the image
  float offset_px = 0;    ///< from a pixel's centre to where its derivative lies, both ways
};
Gradient gradient_of(const cv::Mat& values, const Kernel& kernel);
Gradient gaussian_gradient(const cv::Mat& values, double sigma_px);

/// The standard deviation that noise alone gives to a component of the gradient, as a function of the value: X-ray
/// noise depends on brightness. Measured as the median absolute deviation in blocks of 16 x 16 pixels, of which those
/// of equal brightness that vary least are believed.
class NoiseLevel {
 public:
  NoiseLevel(const Prepared& image, const Gradient& gradient);
  float at(float value) const;

 private:
  std::vector<std::pair<float, float>> noise_of_value_;  ///< ascending values
};

}  // namespace marrow::image
