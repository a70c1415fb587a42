// SPDX-License-Identifier: Apache-2.0
#pragma once
// Statistics of a moving window. They are computed for blocks of 16 x 16 pixels and interpolated between block centres.
#include <array>
#include <vector>

#include "marrow/edges/gradient.hpp"

namespace marrow::edges {

/// Percentiles of the gradient's magnitude over the usable pixels of a window around each block. For each percentage a
/// CV_32F matrix with one value per block of 16 x 16 pixels; 0 where the window has no usable pixel. The window's side
/// is the largest odd number of blocks within `window_px`, at least one. `usable` is CV_8U, non-zero at usable pixels.
std::array<cv::Mat, 3> window_percentiles(const Gradient& gradient, const cv::Mat& usable, int window_px,
                                          const std::array<double, 3>& percents);

/// The noise of a component of the gradient (NoiseLevel), one CV_32F value per block.
cv::Mat block_noise(const Prepared& image, const Gradient& gradient);

/// Bilinear interpolation between the centres of blocks, along row `v` of the image. row.size() is the image's width.
void interpolate_row(const cv::Mat& blocks, int v, std::vector<float>& row);

}  // namespace marrow::edges
