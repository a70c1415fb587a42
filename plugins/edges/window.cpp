// SPDX-License-Identifier: Apache-2.0
#include "window.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <bit>
#include <cstdint>

namespace marrow::edges {
namespace {

constexpr int kBlock = 16;
constexpr int kBins = 256;  // of a histogram with 16 bins an octave

/// Histograms of the magnitude in blocks. A bin is made from exponent and leading mantissa bits of the float, so it is
/// about 5 % wide whatever the size of the values; the range ends at the image's largest magnitude.
class BlockHistograms {
 public:
  BlockHistograms(const Gradient& gradient, const cv::Mat& usable)
      : columns((usable.cols + kBlock - 1) / kBlock), rows((usable.rows + kBlock - 1) / kBlock) {
    double largest = 0;
    cv::minMaxLoc(gradient.magnitude, nullptr, &largest);
    lowest_ = int(std::bit_cast<std::uint32_t>(float(largest)) >> kShift) - (kBins - 1);
    counts_.assign(std::size_t(columns) * rows * kBins, 0);
    tbb::parallel_for(0, rows, [&](int row) {
      for (int v = row * kBlock; v < std::min(usable.rows, (row + 1) * kBlock); ++v) {
        const float* magnitude = gradient.magnitude.ptr<float>(v);
        const uchar* use = usable.ptr<uchar>(v);
        for (int u = 0; u < usable.cols; ++u)
          if (use[u]) ++counts(row, u / kBlock)[bin(magnitude[u])];
      }
    });
  }

  /// Counts of a square of blocks, `reach` blocks each way.
  std::vector<std::uint32_t> window(int row, int column, int reach) const {
    std::vector<std::uint32_t> sum(kBins, 0);
    for (int r = std::max(0, row - reach); r <= std::min(rows - 1, row + reach); ++r)
      for (int c = std::max(0, column - reach); c <= std::min(columns - 1, column + reach); ++c) {
        const std::uint16_t* block = counts_.data() + (std::size_t(r) * columns + c) * kBins;
        for (int i = 0; i < kBins; ++i) sum[i] += block[i];
      }
    return sum;
  }

  float percentile(const std::vector<std::uint32_t>& window, double percent) const {
    std::uint32_t total = 0;
    for (std::uint32_t count : window) total += count;
    double left = percent / 100 * total;
    for (int i = 0; i < kBins && total > 0; ++i) {
      if (left <= window[i] && window[i] > 0) return edge(i) + float(left / window[i]) * (edge(i + 1) - edge(i));
      left -= window[i];
    }
    return 0;
  }

  const int columns, rows;

 private:
  static constexpr int kShift = 23 - 4;

  std::uint16_t* counts(int row, int column) { return counts_.data() + (std::size_t(row) * columns + column) * kBins; }
  int bin(float magnitude) const {
    return std::clamp(int(std::bit_cast<std::uint32_t>(magnitude) >> kShift) - lowest_, 0, kBins - 1);
  }
  float edge(int bin) const { return std::bit_cast<float>(std::uint32_t(std::max(0, lowest_ + bin)) << kShift); }

  int lowest_ = 0;
  std::vector<std::uint16_t> counts_;
};

}  // namespace

std::array<cv::Mat, 3> window_percentiles(const Gradient& gradient, const cv::Mat& usable, int window_px,
                                          const std::array<double, 3>& percents) {
  const BlockHistograms histograms(gradient, usable);
  const int reach = std::max(0, (window_px / kBlock - 1) / 2);
  std::array<cv::Mat, 3> percentiles;
  for (cv::Mat& values : percentiles) values.create(histograms.rows, histograms.columns, CV_32F);
  tbb::parallel_for(0, histograms.rows, [&](int row) {
    for (int column = 0; column < histograms.columns; ++column) {
      const auto window = histograms.window(row, column, reach);
      for (std::size_t i = 0; i < percents.size(); ++i)
        percentiles[i].at<float>(row, column) = histograms.percentile(window, percents[i]);
    }
  });
  return percentiles;
}

cv::Mat block_noise(const Prepared& image, const Gradient& gradient, double sigma_px) {
  const NoiseLevel noise(image, gradient, sigma_px);
  const cv::Size size = image.values.size();
  cv::Mat levels((size.height + kBlock - 1) / kBlock, (size.width + kBlock - 1) / kBlock, CV_32F);
  for (int row = 0; row < levels.rows; ++row)
    for (int column = 0; column < levels.cols; ++column) {
      const cv::Rect block = cv::Rect(column * kBlock, row * kBlock, kBlock, kBlock) & cv::Rect({0, 0}, size);
      levels.at<float>(row, column) = noise.at(float(cv::mean(image.values(block))[0]));
    }
  return levels;
}

void interpolate_row(const cv::Mat& blocks, int v, std::vector<float>& row) {
  const auto place = [](int pixel, int count) {
    const float at = std::clamp((float(pixel) + 0.5f) / kBlock - 0.5f, 0.0f, float(count - 1));
    const int first = std::min(int(at), std::max(0, count - 2));
    return std::pair(first, at - float(first));
  };
  const auto [top, lower_part] = place(v, blocks.rows);
  const float* upper = blocks.ptr<float>(top);
  const float* lower = blocks.ptr<float>(std::min(top + 1, blocks.rows - 1));
  for (std::size_t u = 0; u < row.size(); ++u) {
    const auto [left, right_part] = place(int(u), blocks.cols);
    const int right = std::min(left + 1, blocks.cols - 1);
    row[u] = (1 - lower_part) * (upper[left] + right_part * (upper[right] - upper[left])) +
             lower_part * (lower[left] + right_part * (lower[right] - lower[left]));
  }
}

}  // namespace marrow::edges
