// SPDX-License-Identifier: Apache-2.0
#pragma once
// What the nodes that mask a view have in common: the last step.
#include <marrow/plugin.hpp>
#include <opencv2/imgproc.hpp>

namespace marrow::mask {

/// The view with a mask that is 0 where `left_out` (CV_8U, of the image's size) is not 0, within margin_px of it, and
/// where the view's mask was 0 before. Elsewhere it is as before, or 255 if the view had none.
inline View without(const View& view, const cv::Mat& left_out, int margin_px) {
  cv::Mat wider = left_out;
  if (margin_px > 0) {
    const int side = 2 * margin_px + 1;
    cv::dilate(left_out, wider, cv::getStructuringElement(cv::MORPH_ELLIPSE, {side, side}));
  }
  View result = view;
  result.mask = view.mask.empty() ? cv::Mat(left_out.size(), CV_8U, cv::Scalar(255)) : view.mask.clone();
  result.mask.setTo(0, wider);
  return result;
}

}  // namespace marrow::mask
