// SPDX-License-Identifier: Apache-2.0
#pragma once
// Statistics of a moving window, found for blocks of pixels and interpolated between the blocks' centres.
#include <array>
#include <vector>

#include "marrow/toolbox/image/gradient.hpp"

namespace marrow::image {

/// The magnitudes below which so many percent of the usable pixels of a window lie, one CV_32F value a block of 16 x 16
/// pixels for each percentage; 0 where the window has no usable pixel. The window is an odd number of blocks wide.
std::array<cv::Mat, 3> window_percentiles(const Gradient& gradient, const cv::Mat& usable, int window_px,
                                          const std::array<double, 3>& percents);

/// The noise of a component of the gradient (NoiseLevel), one CV_32F value a block.
cv::Mat block_noise(const Prepared& image, const Gradient& gradient);

/// Bilinear interpolation between the centres of blocks, along one row of pixels.
void interpolate_row(const cv::Mat& blocks, int v, std::vector<float>& row);

}  // namespace marrow::image
