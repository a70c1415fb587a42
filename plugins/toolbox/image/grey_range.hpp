// SPDX-License-Identifier: Apache-2.0
#pragma once
// The scale of an image's grey values. Single pixels must not decide it: a defect of the detector, or letters that were
// drawn into the image, may be far brighter than all that the X-rays show.
#include <cstddef>
#include <marrow/domain/camera.hpp>
#include <marrow/runtime/node/context.hpp>
#include <opencv2/core/mat.hpp>

namespace marrow::image {

/// Of the pixels that are finite. A pixel is beyond if it is brighter than all medians of 5 x 5 pixels, by more than a
/// quarter of their range and ten deviations of the noise, or darker in the same way and negative. If more than 0.5 %
/// of the pixels were beyond, or the others were all the same, none is.
struct GreyRange {
  double least = 0, greatest = 0;  ///< of the pixels that are not beyond; both 0 without a finite pixel
  double farthest = 0;             ///< the value of the pixel that is farthest beyond
  std::size_t beyond = 0;          ///< number of pixels
  std::size_t all = 0;             ///< number of finite pixels
  /// Number of pixels that are negative by more than 0.5 % of the range: noise about 0 is less.
  std::size_t negative = 0;
  /// The grey value where no light falls. It is 0, but `least` if more than 0.5 % of the pixels are negative. Then the
  /// image has an offset, which is not known more exactly.
  double dark() const { return double(negative) > 0.005 * double(all) ? least : 0; }
};

/// `image` has one channel of any type.
GreyRange grey_range(const cv::Mat& image);

/// Warns if pixels of the view are beyond the range of the others, or so many are negative that the image has an
/// offset, and says how they count.
void warn_of_greys(const View& view, const Context& context);

}  // namespace marrow::image
