// SPDX-License-Identifier: Apache-2.0
#include "marrow/mask/leave_out.hpp"

#include <opencv2/imgproc.hpp>

namespace marrow::mask {

View without(const View& view, const cv::Mat& left_out, int margin_px) {
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
