// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/image/line_integrals.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/core.hpp>

namespace marrow::image {

GreyScale::GreyScale(const cv::Mat& image) {
  double largest = 0;
  cv::minMaxLoc(image, nullptr, &largest);
  if (largest > 0) brightest_ = largest;
}

double GreyScale::line_integral(double grey) const {
  return std::isnan(grey) ? grey : -std::log(std::max(grey / brightest_, kLeast));
}

cv::Mat line_integrals(const cv::Mat& image) {
  const GreyScale scale(image);
  cv::Mat values;
  image.convertTo(values, CV_32F, 1 / scale.brightest());
  const cv::Mat unknown = values != values;
  cv::max(values, GreyScale::kLeast, values);
  cv::log(values, values);
  values = -values;
  values.setTo(std::numeric_limits<float>::quiet_NaN(), unknown);
  return values;
}

}  // namespace marrow::image
