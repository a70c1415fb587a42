// SPDX-License-Identifier: Apache-2.0
// What stands out by its grey value alone, such as an implant of metal: the silhouette without a network.
#include <algorithm>
#include <marrow/plugin.hpp>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "marrow/base/number_text.hpp"

namespace {

using namespace marrow;

struct Options {
  double grey_value = 0;
  int times = 2;
  bool bright = false;
  int opening_px = 3;
  bool at_border = false;
  int region = 1;
};

/// The pixels outside of the detector's field: as dark (or bright) as any, in regions that touch the image's border.
cv::Mat outside_of_field(const cv::Mat& pixels, const Options& options) {
  constexpr double kTolerance = 0.03;  // of the range of grey values
  double low = 0, high = 0;
  cv::minMaxLoc(pixels, &low, &high);
  const double margin = kTolerance * (high - low);
  const cv::Mat extreme = options.bright ? cv::Mat(pixels >= high - margin) : cv::Mat(pixels <= low + margin);
  cv::Mat outside;
  cv::copyMakeBorder(extreme, outside, 1, 1, 1, 1, cv::BORDER_CONSTANT, cv::Scalar(255));
  cv::floodFill(outside, {0, 0}, cv::Scalar(128), nullptr, cv::Scalar(0), cv::Scalar(0), 8);
  return outside(cv::Rect({1, 1}, pixels.size())) == 128;
}

/// The grey value that separates the darkest (or brightest) pixels: by Otsu's method, then again among those of the
/// side that counts.
double separating_value(const cv::Mat& pixels, const cv::Mat& counts, const Options& options) {
  std::vector<std::uint16_t> values;
  const cv::Mat outside = outside_of_field(pixels, options);
  for (int row = 0; row < pixels.rows; ++row)
    for (int column = 0; column < pixels.cols; ++column)
      if ((counts.empty() || counts.at<std::uint8_t>(row, column)) && !outside.at<std::uint8_t>(row, column))
        values.push_back(pixels.at<std::uint16_t>(row, column));
  double value = 0;
  for (int i = 0; i < options.times && !values.empty(); ++i) {
    cv::Mat ignored;
    value = cv::threshold(cv::Mat(1, int(values.size()), CV_16U, values.data()), ignored, 0, 65535,
                          cv::THRESH_BINARY | cv::THRESH_OTSU);
    std::erase_if(values, [&](std::uint16_t one) { return options.bright == (one <= value); });
  }
  return value;
}

/// The region with the given rank by size, as a mask. Throws Error if there are fewer.
cv::Mat region_of(const cv::Mat& mask, const std::string& view, const Options& options) {
  cv::Mat labels, figures, centres;
  const int count = cv::connectedComponentsWithStats(mask, labels, figures, centres, 8, CV_32S);
  std::vector<int> regions;
  for (int region = 1; region < count; ++region) {
    const auto at = [&](int what) { return figures.at<int>(region, what); };
    const int left = at(cv::CC_STAT_LEFT), top = at(cv::CC_STAT_TOP);
    const bool is_cut = left == 0 || top == 0 || left + at(cv::CC_STAT_WIDTH) == mask.cols ||
                        top + at(cv::CC_STAT_HEIGHT) == mask.rows;
    if (options.at_border || !is_cut) regions.push_back(region);
  }
  std::stable_sort(regions.begin(), regions.end(), [&](int a, int b) {
    return figures.at<int>(a, cv::CC_STAT_AREA) > figures.at<int>(b, cv::CC_STAT_AREA);
  });
  if (std::size_t(options.region) > regions.size())
    throw Error(formatted("mask.threshold: view '{}' has {} of that grey value{}, but region {} is wanted; give "
                          "another grey_value, or a smaller opening_px",
                          view, counted(regions.size(), "region"),
                          options.at_border ? "" : " away from the image's border", options.region));
  return labels == regions[std::size_t(options.region - 1)];
}

View threshold(const View& view, const Options& options, Context& context) {
  check_view(view);
  const double value =
      options.grey_value > 0 ? options.grey_value : separating_value(view.image.pixels, view.mask, options);
  cv::Mat kept = options.bright ? cv::Mat(view.image.pixels > value) : cv::Mat(view.image.pixels <= value);
  if (!view.mask.empty()) kept.setTo(0, view.mask == 0);
  if (options.opening_px > 0) {
    const int side = 2 * options.opening_px + 1;
    cv::morphologyEx(kept, kept, cv::MORPH_OPEN, cv::getStructuringElement(cv::MORPH_ELLIPSE, {side, side}));
  }
  View result = view;
  result.mask = region_of(kept, view.name, options);
  context.info(formatted("view '{}': {} pixels {} {:.0f}", view.name, cv::countNonZero(result.mask),
                         options.bright ? "above" : "up to", value));
  return result;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("mask.threshold", threshold)
      .summary("Keeps only what stands out by its grey value, such as an implant of metal")
      .in("view", "X-ray view")
      .out("view", "the same view; its mask is not 0 in this region only, and is 0 where it was 0 before")
      .option("grey_value", &Options::grey_value, "the darkest pixels up to this value count; 0: it is found",
              at_least(0), at_most(65535))
      .option("times", &Options::times,
              "how often Otsu's method divides the grey values, each time those of the side that counts (IEEE Trans "
              "SMC 1979): 1 parts a body from air, 2 metal from the body",
              at_least(1), at_most(5))
      .option("bright", &Options::bright, "the brightest pixels count, those above the value")
      .option("opening_px", &Options::opening_px, "what is narrower than twice this, such as a cable, is cut off",
              at_least(0), at_most(100))
      .option("at_border", &Options::at_border, "regions that touch the image's border count, too")
      .option("region", &Options::region, "which of the regions counts: 1 is the largest", at_least(1), at_most(1000));
}
