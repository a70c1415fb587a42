// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/image/grey_values.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <marrow/domain/quantile.hpp>
#include <opencv2/imgproc.hpp>

#include "marrow/base/number_text.hpp"

namespace marrow::image {
namespace {

/// About this many values at even distances, from the pixels that count.
std::vector<float> sample_of(const cv::Mat& values, const cv::Mat& counts) {
  constexpr std::size_t kAbout = 65536;
  const std::size_t step = values.total() / kAbout + 1;
  std::vector<float> sample;
  for (std::size_t at = 0; at < values.total(); at += step) {
    const int row = int(at / std::size_t(values.cols)), column = int(at % std::size_t(values.cols));
    if (counts.at<uchar>(row, column)) sample.push_back(values.at<float>(row, column));
  }
  return sample;
}

/// The limits outside of which a pixel is beyond: below the first, above the second.
std::pair<double, double> limits_of(const cv::Mat& values, const cv::Mat& finite) {
  constexpr double kPart = 0.25, kDeviations = 10;
  cv::Mat whole = values.clone(), smooth;
  if (std::vector<float> sample = sample_of(values, finite); !sample.empty())
    whole.setTo(quantile_in_place(sample, 0.5), ~finite);
  cv::medianBlur(whole, smooth, 5);
  double low = 0, high = 0;
  cv::minMaxLoc(smooth, &low, &high, nullptr, nullptr, finite);
  std::vector<float> off = sample_of(cv::abs(whole - smooth), finite);
  if (!(high > low) || off.empty()) return {-INFINITY, INFINITY};
  const double margin = std::max(kPart * (high - low), kDeviations * 1.4826 * quantile_in_place(off, 0.5));
  return {std::min(0.0, low) - margin, high + margin};
}

}  // namespace

GreyRange grey_range(const cv::Mat& image) {
  constexpr double kMostShare = 0.005, kNoise = 0.005;
  cv::Mat values;
  image.convertTo(values, CV_32F);
  const cv::Mat finite = cv::abs(values) <= std::numeric_limits<float>::max();
  GreyRange range;
  range.all = std::size_t(cv::countNonZero(finite));
  if (range.all == 0) return range;
  double farthest_low = 0, farthest_high = 0;
  cv::minMaxLoc(values, &farthest_low, &farthest_high, nullptr, nullptr, finite);
  range.least = farthest_low, range.greatest = farthest_high;

  const auto [low, high] = limits_of(values, finite);
  cv::Mat beyond = (values < low) | (values > high);
  beyond &= finite;
  const std::size_t count = std::size_t(cv::countNonZero(beyond));
  if (count > 0 && double(count) <= kMostShare * double(range.all)) {
    range.beyond = count;
    range.farthest = farthest_high - high > low - farthest_low ? farthest_high : farthest_low;
    cv::minMaxLoc(values, &range.least, &range.greatest, nullptr, nullptr, finite & ~beyond);
  }
  const cv::Mat negative = values < -kNoise * (range.greatest - range.least);
  range.negative = std::size_t(cv::countNonZero(negative & finite));
  return range;
}

void warn_of_greys(const View& view, const Context& context) {
  const GreyRange range = grey_range(view.image.pixels);
  const std::string what = "view '" + view.name + "': ", of_all = formatted(" of {} pixels ", range.all);
  if (range.beyond > 0)
    context.warn(
        formatted("{}{}{}{} far beyond all others ({:g}, the others reach from {:g} to {:g}), as defects of a detector "
                  "and letters are; {} as the nearest of the others",
                  what, range.beyond, of_all, range.beyond == 1 ? "is" : "are", range.farthest, range.least,
                  range.greatest, range.beyond == 1 ? "it counts" : "they count"));
  if (range.dark() < 0)
    context.warn(
        formatted("{}{}{}are negative, down to {:g}, which is taken as the grey value where no light falls; edges may "
                  "be off by a fraction of a pixel, so give the detector's own grey values",
                  what, range.negative, of_all, range.least));
}

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
