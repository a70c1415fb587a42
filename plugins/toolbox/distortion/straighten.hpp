// SPDX-License-Identifier: Apache-2.0
#pragma once
// Images and masks without a distortion that was measured with a plate, and masks of the original image again.
#include "marrow/domain/camera.hpp"
#include "marrow/toolbox/distortion/distortion.hpp"

namespace marrow::distortion {

/// Resamples image and mask to the straight image. Its camera stays as it is. Pixels whose place lies outside the
/// original image or the measured area are masked out. Throws Error as check_view() and check_distortion() do, and if
/// the image has another size than the distortion's.
void straighten(View& view, const Distortion& distortion);

/// The mask of the straight image. Each pixel gets the value of the pixel of `original` that is nearest to its place
/// there, or zero outside the original image and the measured area.
cv::Mat1b straightened_mask(const cv::Mat1b& original, const Distortion& distortion);

/// Converts a mask that was drawn on the straight image to the original image. straightened_mask() of the result is
/// zero wherever `straight` is zero. Original pixels that the straight image does not show are 255.
cv::Mat1b original_mask(const cv::Mat1b& straight, const Distortion& distortion);

}  // namespace marrow::distortion
