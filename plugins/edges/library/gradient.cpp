// SPDX-License-Identifier: Apache-2.0
#include "marrow/edges/gradient.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <marrow/base/error.hpp>
#include <marrow/domain/quantile.hpp>
#include <numeric>
#include <opencv2/imgproc.hpp>

#include "marrow/base/number_text.hpp"
#include "marrow/toolbox/image/field_of_view.hpp"
#include "marrow/toolbox/image/grey_range.hpp"
#include "marrow/toolbox/image/line_integrals.hpp"

namespace marrow::edges {
namespace {

constexpr int kBandRows = 64;  // fixed, so that the result does not depend on the number of threads
constexpr int kBlock = 16;
constexpr int kMostBlocks = 1024;  // about the largest number of blocks in which noise is measured

/// Calls function(first row, end row) for bands of rows, in parallel.
template <class Function>
void for_bands(int rows, Function function) {
  tbb::parallel_for(0, (rows + kBandRows - 1) / kBandRows,
                    [&](int band) { function(band * kBandRows, std::min(rows, (band + 1) * kBandRows)); });
}

/// Standard deviation of Gaussian noise with the same median absolute deviation.
float deviation(std::vector<float>& values) {
  const float centre = float(quantile_in_place(values, 0.5));
  for (float& value : values) value = std::abs(value - centre);
  return 1.4826f * float(quantile_in_place(values, 0.5));
}

}  // namespace

Prepared prepare(const View& view, double sigma_px, bool logarithm, const Context& context) {
  check_view(view);
  const std::string what = "view '" + view.name + "'";
  const int type = view.image.pixels.type();
  if (type != CV_8UC1 && type != CV_16UC1 && type != CV_32FC1)
    throw Error(what + ": the image must have one channel of 8 or 16 bit whole numbers or 32 bit floats");
  cv::Mat grey;
  view.image.pixels.convertTo(grey, CV_32F);
  if (type == CV_32FC1 && !cv::checkRange(grey))
    throw Error(what + ": the image holds pixels that are not finite (NaN or infinity)");
  const image::GreyRange range = image::grey_range(grey);
  if (range.least == range.greatest)
    throw Error(formatted("{}: all pixels have the same value {:g}, so there is no edge; check the image file", what,
                          range.least));
  if (logarithm && range.greatest <= 0)
    throw Error(what + ": the image has no positive grey value, so its logarithm cannot be taken");
  image::warn_of_greys(view, context);
  if (range.beyond > 0) grey = cv::min(cv::max(grey, range.least), range.greatest);
  const double dark = range.dark(), smallest = range.least - dark, largest = range.greatest - dark;
  if (dark < 0) grey -= dark;
  Prepared prepared;
  prepared.usable = image::usable_pixels(view, grey, smallest, largest, int(std::ceil(3 * sigma_px)));
  if (cv::countNonZero(prepared.usable) == 0)
    throw Error(
        formatted("{}: no pixel is left to search for edges (mask, image border and smoothing take all of {} x {})",
                  what, grey.cols, grey.rows));
  prepared.whole_numbers = type != CV_32FC1;
  prepared.range = float(largest - smallest);
  prepared.logarithm = logarithm;
  prepared.brightest = float(largest);
  prepared.values = logarithm ? cv::Mat(-image::line_integrals(grey)) : grey;
  return prepared;
}

Kernel gaussian_kernel(double sigma_px, double reach) {
  const int radius = int(std::ceil(reach * sigma_px));
  Kernel kernel;
  double sum = 0, slope = 0;
  for (int i = -radius; i <= radius; ++i) {
    const double weight = std::exp(-0.5 * i * i / (sigma_px * sigma_px));
    kernel.smooth.push_back(float(weight));
    kernel.derive.push_back(float(i * weight));
    sum += weight;
    slope += i * i * weight;
  }
  for (float& weight : kernel.smooth) weight /= float(sum);    // a constant stays the same
  for (float& weight : kernel.derive) weight /= float(slope);  // a ramp of slope 1 gives 1
  return kernel;
}

Kernel smoothed_mask(const Kernel& mask, double sigma_px) {
  if (sigma_px == 0) return mask;
  const std::vector<float> gauss = gaussian_kernel(sigma_px).smooth;
  const auto convolved = [&](const std::vector<float>& weights) {
    std::vector<float> result(weights.size() + gauss.size() - 1, 0.0f);
    for (std::size_t i = 0; i < weights.size(); ++i)
      for (std::size_t k = 0; k < gauss.size(); ++k) result[i + k] += weights[i] * gauss[k];
    return result;
  };
  return {convolved(mask.smooth), convolved(mask.derive)};
}

Gradient gradient_of(const cv::Mat& values, const Kernel& kernel) {
  const auto norm = [](const std::vector<float>& weights) {
    return std::sqrt(std::inner_product(weights.begin(), weights.end(), weights.begin(), 0.0));
  };
  Gradient gradient;
  gradient.noise_gain = norm(kernel.smooth) * norm(kernel.derive);
  gradient.offset_px = kernel.smooth.size() % 2 ? 0.0f : 0.5f;
  for (cv::Mat* part : {&gradient.du, &gradient.dv, &gradient.magnitude}) part->create(values.size(), CV_32F);
  const cv::Point anchor(int(kernel.smooth.size() - 1) / 2, int(kernel.smooth.size() - 1) / 2);
  for_bands(values.rows, [&](int first, int end) {
    const cv::Mat band = values.rowRange(first, end);  // OpenCV's filter also reads rows beside the band
    cv::Mat du = gradient.du.rowRange(first, end), dv = gradient.dv.rowRange(first, end);
    cv::Mat magnitude = gradient.magnitude.rowRange(first, end);
    cv::sepFilter2D(band, du, CV_32F, kernel.derive, kernel.smooth, anchor);
    cv::sepFilter2D(band, dv, CV_32F, kernel.smooth, kernel.derive, anchor);
    cv::magnitude(du, dv, magnitude);
  });
  return gradient;
}

Gradient gaussian_gradient(const cv::Mat& values, double sigma_px) {
  return gradient_of(values, gaussian_kernel(sigma_px));
}

NoiseLevel::NoiseLevel(const Prepared& image, const Gradient& gradient) {
  const int columns = image.values.cols / kBlock, rows = image.values.rows / kBlock;
  const int step = columns * rows / kMostBlocks + 1;
  std::vector<std::pair<float, float>> blocks(std::size_t(columns) * rows, {0.0f, -1.0f});  // value, noise
  tbb::parallel_for(0, rows, [&](int row) {
    std::vector<float> du, dv;
    for (int column = 5 * row % step; column < columns; column += step) {
      du.clear(), dv.clear();
      double sum = 0;
      for (int v = row * kBlock; v < (row + 1) * kBlock; v += 2)  // every other pixel: noise of neighbours correlates
        for (int u = column * kBlock; u < (column + 1) * kBlock; u += 2) {
          if (!image.usable.at<uchar>(v, u)) continue;
          du.push_back(gradient.du.at<float>(v, u)), dv.push_back(gradient.dv.at<float>(v, u));
          sum += image.values.at<float>(v, u);
        }
      if (du.size() < kBlock * kBlock / 8) continue;
      const float value = float(sum / double(du.size()));
      blocks[std::size_t(row) * columns + column] = {value, std::min(deviation(du), deviation(dv))};
    }
  });
  std::erase_if(blocks, [](const auto& block) { return block.second < 0; });
  std::sort(blocks.begin(), blocks.end());

  // Rounding to whole grey values has the standard deviation 1 / sqrt(12). For images of floats, 1e-5 of their range is
  // used instead.
  const double rounding = (image.whole_numbers ? 0.29 : 1e-5 * image.range) * gradient.noise_gain;
  const std::size_t groups = std::clamp<std::size_t>(blocks.size() / 32, 1, 8);
  for (std::size_t group = 0; group < groups && !blocks.empty(); ++group) {
    std::vector<float> values, noises;
    for (std::size_t i = group * blocks.size() / groups; i < (group + 1) * blocks.size() / groups; ++i) {
      values.push_back(blocks[i].first);
      noises.push_back(blocks[i].second);
    }
    const float value = float(quantile_in_place(values, 0.5));
    const float least = float(rounding * image.slope(value));
    constexpr double kQuietest = 0.3;  // texture only adds to the noise
    noise_of_value_.emplace_back(value, std::max(least, float(quantile_in_place(noises, kQuietest))));
  }
  if (noise_of_value_.empty())
    noise_of_value_.emplace_back(0.0f, float(rounding * image.slope(image.values.at<float>(0, 0))));
}

float NoiseLevel::at(float value) const {
  const auto above = std::upper_bound(noise_of_value_.begin(), noise_of_value_.end(), std::pair(value, 0.0f));
  if (above == noise_of_value_.begin()) return above->second;
  const auto below = above - 1;
  if (above == noise_of_value_.end() || above->first <= below->first) return below->second;
  const float part = (value - below->first) / (above->first - below->first);
  return below->second + part * (above->second - below->second);
}

}  // namespace marrow::edges
