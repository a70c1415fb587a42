// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/image/line_integrals.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/core.hpp>

#include "marrow/toolbox/image/grey_range.hpp"

namespace marrow::image {

GreyScale::GreyScale(const cv::Mat& image) {
  const GreyRange range = grey_range(image);
  dark_ = range.dark();
  if (range.greatest > dark_) air_ = range.greatest - dark_;
}

double GreyScale::line_integral(double grey) const {
  return std::isnan(grey) ? grey : -std::log(std::clamp((grey - dark_) / air_, kLeast, 1.0));
}

cv::Mat line_integrals(const cv::Mat& image) {
  const GreyScale scale(image);
  cv::Mat values;
  image.convertTo(values, CV_32F, 1 / scale.air(), -scale.dark() / scale.air());
  const cv::Mat unknown = values != values;
  cv::max(values, GreyScale::kLeast, values);
  cv::min(values, 1.0, values);
  cv::log(values, values);
  values = -values;
  values.setTo(std::numeric_limits<float>::quiet_NaN(), unknown);
  return values;
}

}  // namespace marrow::image
