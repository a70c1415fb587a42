// SPDX-License-Identifier: Apache-2.0
#pragma once
// What the nodes that mask a view have in common: the last step.
#include <marrow/plugin.hpp>
#include <opencv2/core/mat.hpp>

namespace marrow::mask {

/// The view with a mask that is 0 where `left_out` (CV_8U, of the image's size) is not 0, within margin_px of it, and
/// where the view's mask was 0 before. Elsewhere it is as before, or 255 if the view had none.
View without(const View& view, const cv::Mat& left_out, int margin_px);

}  // namespace marrow::mask
