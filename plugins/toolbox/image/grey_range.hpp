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

}  // namespace marrow::image
