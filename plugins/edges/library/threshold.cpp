// SPDX-License-Identifier: Apache-2.0
#include "marrow/edges/threshold.hpp"

#include <tbb/parallel_for.h>

#include <bit>
#include <numeric>

namespace marrow::edges {

EdgeMap edges_above_noise(const Prepared& image, const Gradient& gradient, const ThresholdOptions& options,
                          const WayToEdge& way) {
  const cv::Mat median = window_percentiles(gradient, image.usable, options.window_px, {50, 50, 50})[0];
  const cv::Mat least = median + options.threshold * block_noise(image, gradient);
  const int rows = image.values.rows, columns = image.values.cols;
  cv::Mat marked(rows, columns, CV_8U, cv::Scalar(0));
  tbb::parallel_for(1, rows - 1, [&](int v) {
    std::vector<float> least_row(columns);
    interpolate_row(least, v, least_row);
    const float* magnitude = gradient.magnitude.ptr<float>(v);
    const uchar* use = image.usable.ptr<uchar>(v);
    for (int u = 1; u < columns - 1; ++u)
      if (use[u] && magnitude[u] > least_row[u] && passes(gradient, way(u, v), u, v)) marked.at<uchar>(v, u) = 255;
  });
  return refined(image, gradient, marked, way);
}

namespace {

constexpr int kWindowBlock = 16;
constexpr int kBins = 256;  // of a histogram with 16 bins per octave

/// Histograms of the magnitude in blocks. A bin is given by the exponent and the leading mantissa bits of the float, so
/// all bins are about 5 % wide, for values of any size. The range ends at the image's largest magnitude.
class BlockHistograms {
 public:
  BlockHistograms(const Gradient& gradient, const cv::Mat& usable)
      : columns((usable.cols + kWindowBlock - 1) / kWindowBlock),
        rows((usable.rows + kWindowBlock - 1) / kWindowBlock) {
    double largest = 0;
    cv::minMaxLoc(gradient.magnitude, nullptr, &largest);
    lowest_ = int(std::bit_cast<std::uint32_t>(float(largest)) >> kShift) - (kBins - 1);
    counts_.assign(std::size_t(columns) * rows * kBins, 0);
    tbb::parallel_for(0, rows, [&](int row) {
      for (int v = row * kWindowBlock; v < std::min(usable.rows, (row + 1) * kWindowBlock); ++v) {
        const float* magnitude = gradient.magnitude.ptr<float>(v);
        const uchar* use = usable.ptr<uchar>(v);
        for (int u = 0; u < usable.cols; ++u)
          if (use[u]) ++counts(row, u / kWindowBlock)[bin(magnitude[u])];
      }
    });
  }

  /// Calls function(column, counts) for each block of a row, with the counts of a square of blocks around it, `reach`
  /// blocks to each side. The square moves along the row: one column of blocks enters it, another one leaves.
  template <class Function>
  void for_windows(int row, int reach, Function function) const {
    std::vector<std::uint32_t> sums(std::size_t(columns) * kBins, 0), window(kBins, 0);
    for (int r = std::max(0, row - reach); r <= std::min(rows - 1, row + reach); ++r) {
      const std::uint16_t* blocks = counts_.data() + std::size_t(r) * columns * kBins;
      for (std::size_t i = 0; i < sums.size(); ++i) sums[i] += blocks[i];
    }
    const auto change = [&](int column, std::uint32_t sign) {
      if (column < 0 || column >= columns) return;
      for (int i = 0; i < kBins; ++i) window[i] += sign * sums[std::size_t(column) * kBins + i];
    };
    for (int column = 0; column < reach; ++column) change(column, 1);
    for (int column = 0; column < columns; ++column) {
      change(column + reach, 1);
      change(column - reach - 1, std::uint32_t(-1));  // a subtraction, modulo 2^32
      function(column, window);
    }
  }

  /// The magnitude below which this part of the counts lies. sums[i]: number of counts in bins 0 to i.
  float quantile(const std::vector<std::uint32_t>& sums, double part) const {
    if (sums.back() == 0) return 0;
    const double wanted = part * sums.back();
    auto bin = std::lower_bound(sums.begin(), sums.end(), wanted,
                                [](std::uint32_t sum, double least) { return sum < least || sum == 0; });
    const int i = int(bin - sums.begin());
    const double before = i > 0 ? sums[std::size_t(i - 1)] : 0, inside = (wanted - before) / (*bin - before);
    return edge(i) + float(inside) * (edge(i + 1) - edge(i));
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
  const int reach = std::max(0, (window_px / kWindowBlock - 1) / 2);
  std::array<cv::Mat, 3> percentiles;
  for (cv::Mat& values : percentiles) values.create(histograms.rows, histograms.columns, CV_32F);
  tbb::parallel_for(0, histograms.rows, [&](int row) {
    std::vector<std::uint32_t> sums(kBins);
    histograms.for_windows(row, reach, [&](int column, const std::vector<std::uint32_t>& window) {
      std::partial_sum(window.begin(), window.end(), sums.begin());
      for (std::size_t i = 0; i < percents.size(); ++i)
        percentiles[i].at<float>(row, column) = histograms.quantile(sums, percents[i] / 100);
    });
  });
  return percentiles;
}

cv::Mat block_noise(const Prepared& image, const Gradient& gradient) {
  const NoiseLevel noise(image, gradient);
  const cv::Size size = image.values.size();
  cv::Mat levels((size.height + kWindowBlock - 1) / kWindowBlock, (size.width + kWindowBlock - 1) / kWindowBlock,
                 CV_32F);
  for (int row = 0; row < levels.rows; ++row)
    for (int column = 0; column < levels.cols; ++column) {
      const cv::Rect block =
          cv::Rect(column * kWindowBlock, row * kWindowBlock, kWindowBlock, kWindowBlock) & cv::Rect({0, 0}, size);
      levels.at<float>(row, column) = noise.at(float(cv::mean(image.values(block))[0]));
    }
  return levels;
}

void interpolate_row(const cv::Mat& blocks, int v, std::vector<float>& row) {
  const float place = std::clamp((float(v) + 0.5f) / kWindowBlock - 0.5f, 0.0f, float(blocks.rows - 1));
  const int top = std::min(int(place), std::max(0, blocks.rows - 2));
  const float lower_part = place - float(top);
  const float* upper = blocks.ptr<float>(top);
  const float* lower = blocks.ptr<float>(std::min(top + 1, blocks.rows - 1));
  const auto at = [&](int column) { return upper[column] + lower_part * (lower[column] - upper[column]); };
  const std::size_t width = row.size();
  std::fill_n(row.begin(), std::min<std::size_t>(kWindowBlock / 2, width), at(0));
  for (int column = 0; column < blocks.cols; ++column) {  // from this block's centre to the next one's
    const std::size_t first = std::size_t(column) * kWindowBlock + kWindowBlock / 2;
    const float here = at(column), change = at(std::min(column + 1, blocks.cols - 1)) - here;
    std::array<float, kWindowBlock> between;
    for (int i = 0; i < kWindowBlock; ++i) between[std::size_t(i)] = here + (float(i) + 0.5f) / kWindowBlock * change;
    if (first < width)
      std::copy_n(between.begin(), std::min<std::size_t>(kWindowBlock, width - first),
                  row.begin() + std::ptrdiff_t(first));
  }
}

}  // namespace marrow::edges
