// SPDX-License-Identifier: Apache-2.0
#pragma once
// The common part of all edge detectors: the prepared image, its gradient, and the noise of this gradient.
#include <cmath>
#include <marrow/domain/camera.hpp>
#include <marrow/domain/features.hpp>
#include <marrow/runtime/node/context.hpp>

namespace marrow::edges {

/// The values whose edges are sought: grey values or, with `logarithm`, line integrals times -1 (GreyScale).
/// Edges are then steps of attenuation, equally high in bright and dark parts of the image.
struct Prepared {
  cv::Mat values;  ///< CV_32F
  cv::Mat usable;  ///< CV_8U, non-zero where edges may be reported
  bool logarithm = false;
  bool whole_numbers = false;  ///< grey values are integers, so there is at least rounding noise
  float range = 0;             ///< largest minus smallest grey value
  float brightest = 0;         ///< largest grey value, counted from where no light falls

  /// By how much `value` changes for one grey value.
  float slope(float value) const { return logarithm ? std::exp(-value) / brightest : 1.0f; }
};

/// Checks the view and prepares its image. The usable pixels keep a distance of 3 sigma from pixels that View::mask
/// excludes, from the outside of a round collimator's field, from black areas that reach three corners, and from the
/// image's border. Warns as warn_of_greys() does. Throws Error if check_view() refuses the view, or for an image that
/// is not CV_8UC1, CV_16UC1 or CV_32FC1, is constant, holds NaN or infinity, has no usable pixel, or has no positive
/// value for the logarithm.
Prepared prepare(const View& view, double sigma_px, bool logarithm, const Context& context);

/// A separable filter for a derivative: `derive` along its axis, `smooth` along the other. Both have the same number of
/// weights. If this is even, the derivative lies half a pixel to the right of and half a pixel below its pixel's
/// centre.
struct Kernel {
  std::vector<float> smooth, derive;
};
/// Derivative of a Gaussian, cut off at `reach` times sigma.
Kernel gaussian_kernel(double sigma_px, double reach = 3);
/// A small mask convolved with a Gaussian. With sigma 0 it is the mask itself.
Kernel smoothed_mask(const Kernel& mask, double sigma_px);

/// Derivatives of the image, per pixel; CV_32F.
struct Gradient {
  cv::Mat du, dv, magnitude;
  double noise_gain = 1;  ///< standard deviation of du and dv for white noise of standard deviation 1 in the image
  float offset_px = 0;    ///< from a pixel's centre to the position of its derivative, in u and in v
};
Gradient gradient_of(const cv::Mat& values, const Kernel& kernel);
Gradient gaussian_gradient(const cv::Mat& values, double sigma_px);

/// Standard deviation of a component of the gradient that is due to noise alone. It is a function of the image's value,
/// because X-ray noise depends on brightness. It comes from the median absolute deviation in blocks of 16 x 16 pixels.
/// Among blocks of similar brightness those with little variation count, because structures in the image add to it.
class NoiseLevel {
 public:
  NoiseLevel(const Prepared& image, const Gradient& gradient);
  float at(float value) const;

 private:
  std::vector<std::pair<float, float>> noise_of_value_;  ///< ascending values
};

// From edge pixels to sub-pixel edges.

/// Distance along the gradient, in pixels, from the centre of a pixel to the ridge of the gradient's magnitude.
/// std::nullopt if the magnitude has no maximum across the edge. The pixel must not lie on the image's border. A
/// parabola is fitted to the logarithm of the magnitude over 3 x 3 pixels (the facet model of Steger, IEEE TPAMI 1998).
/// A straight step smoothed by a Gaussian has exactly this shape, at any orientation, so its position is unbiased.
std::optional<float> way_to_ridge(const Gradient& gradient, int u, int v);

/// Distance along the gradient, in pixels, from a pixel's centre to an edge, if there is one. Must be safe to call from
/// several threads at once.
using WayToEdge = std::function<std::optional<float>(int u, int v)>;

/// Whether the edge passes through this pixel or just beside it. The pixels that pass form a thin edge without gaps.
bool passes(const Gradient& gradient, std::optional<float> way, int u, int v);

/// Bilinear value of a CV_32F image of at least 2 x 2 pixels. Beyond the border it is extrapolated from the nearest
/// four pixels.
float bilinear(const cv::Mat& values, float u, float v);

/// The edges at sub-pixel positions with the direction and magnitude (grey values per pixel) of the gradient there. At
/// most one for each pixel, in row-major order. `marked` is CV_8U, non-zero at edge pixels. `way` leads to the edge; if
/// it is empty, way_to_ridge() does. An edge without a way stays at its pixel's centre.
EdgeMap refined(const Prepared& image, const Gradient& gradient, const cv::Mat& marked, const WayToEdge& way = {});

}  // namespace marrow::edges
