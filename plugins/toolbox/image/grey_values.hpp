// SPDX-License-Identifier: Apache-2.0
#pragma once
// The scale of an image's grey values. Single pixels must not decide it: a defect of the detector, or letters that were
// drawn into the image, may be far brighter than all that the X-rays show.
#include <cstddef>
#include <marrow/domain/camera.hpp>
#include <marrow/runtime/node/context.hpp>
#include <opencv2/core/mat.hpp>

namespace marrow::image {

/// The grey values of the finite pixels, and the outliers among them, which are called beyond. A pixel is beyond if it
/// is brighter than all medians of 5 x 5 pixels, by more than a quarter of their range and ten deviations of the noise.
/// So is a negative pixel that is darker by as much. If this holds for more than 0.5 % of the pixels, or if all others
/// are the same, no pixel counts as beyond.
struct GreyRange {
  double least = 0, greatest = 0;  ///< of the pixels that are not beyond; both 0 without a finite pixel
  double farthest = 0;             ///< the value of the pixel that is farthest beyond
  std::size_t beyond = 0;          ///< number of pixels
  std::size_t all = 0;             ///< number of finite pixels
  /// Number of pixels that are negative by more than 0.5 % of the range: noise about 0 is less.
  std::size_t negative = 0;
  /// The grey value where no light falls. It is 0. But if more than 0.5 % of the pixels are negative, the image has an
  /// offset, and `least` is the best estimate.
  double dark() const { return double(negative) > 0.005 * double(all) ? least : 0; }
};

/// `image` has one channel of any type.
GreyRange grey_range(const cv::Mat& image);

/// Warns of pixels that are beyond the range of the others, and of so many negative ones that the image has an offset.
/// The warning says how they count.
void warn_of_greys(const View& view, const Context& context);

/// The scale of an image's grey values (GreyRange), whose brightest value is taken as air. Bright = air. By the law of
/// Beer and Lambert a ray that passes a body leaves the grey value I0 exp(-line integral), where I0 is the grey value
/// behind air.
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
