// SPDX-License-Identifier: Apache-2.0
#pragma once
// Attenuation from grey values. By the law of Beer and Lambert a ray that passes a body leaves the grey value
// I0 exp(-line integral), where I0 is the grey value behind air.
#include <opencv2/core/mat.hpp>

namespace marrow::image {

/// The scale of an image's grey values (grey_range.hpp), whose brightest value is taken as air. Bright = air.
class GreyScale {
 public:
  /// Darker values count as this fraction of the brightest. They hold scatter and noise, which their logarithm would
  /// magnify.
  static constexpr double kLeast = 0.005;

  /// `image` has one channel of any type; NaN is ignored. Without a positive value, all of the image counts as dark.
  explicit GreyScale(const cv::Mat& image);

  /// The grey value where no light falls, and by how much that behind air is above it.
  double dark() const { return dark_; }
  double air() const { return air_; }
  /// -ln((grey - dark) / air), without unit: 0 for air and what is brighter, at most 5.3. NaN for NaN.
  double line_integral(double grey) const;

 private:
  double dark_ = 0, air_ = 1;
};

/// GreyScale::line_integral() of each pixel, as CV_32F.
cv::Mat line_integrals(const cv::Mat& image);

}  // namespace marrow::image
