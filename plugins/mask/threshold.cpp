// SPDX-License-Identifier: Apache-2.0
// What stands out by its grey value alone, such as an implant of metal: the silhouette without a network.
#include <marrow/plugin.hpp>
#include <opencv2/imgproc.hpp>

namespace {

using namespace marrow;

struct Options {
  double grey_value = 0;
  int times = 4;
  bool bright = false;
  int opening_px = 3;
  double least_percent = 0.2;
  bool at_border = false;
  int region = 1;
};

/// Without what is narrow.
void open_mask(cv::Mat& mask, const Options& options) {
  if (options.opening_px == 0) return;
  const int side = 2 * options.opening_px + 1;
  cv::morphologyEx(mask, mask, cv::MORPH_OPEN, cv::getStructuringElement(cv::MORPH_ELLIPSE, {side, side}));
}

/// The pixels outside of the detector's field: as dark (or bright) as any, in regions that touch the image's border.
cv::Mat outside_of_field(const cv::Mat& pixels, const Options& options) {
  constexpr double kTolerance = 0.03;  // of the range of grey values
  double low = 0, high = 0;
  cv::minMaxLoc(pixels, &low, &high);
  const double margin = kTolerance * (high - low);
  cv::Mat extreme = options.bright ? cv::Mat(pixels >= high - margin) : cv::Mat(pixels <= low + margin);
  open_mask(extreme, options);  // a cable may join a part of metal with the border
  cv::Mat outside;
  cv::copyMakeBorder(extreme, outside, 1, 1, 1, 1, cv::BORDER_CONSTANT, cv::Scalar(255));
  cv::floodFill(outside, {0, 0}, cv::Scalar(128), nullptr, cv::Scalar(0), cv::Scalar(0), 8);
  return outside(cv::Rect({1, 1}, pixels.size())) == 128;
}

/// The grey values of the pixels that count.
std::vector<std::uint16_t> values_of(const cv::Mat& pixels, const View& view, const Options& options) {
  std::vector<std::uint16_t> values;
  const cv::Mat outside = outside_of_field(pixels, options);
  for (int row = 0; row < pixels.rows; ++row)
    for (int column = 0; column < pixels.cols; ++column)
      if ((view.mask.empty() || view.mask.at<std::uint8_t>(row, column)) && !outside.at<std::uint8_t>(row, column))
        values.push_back(pixels.at<std::uint16_t>(row, column));
  return values;
}

/// The regions on the side of the value that counts, the largest first, as a mask each.
std::vector<cv::Mat> regions_at(double value, const cv::Mat& pixels, const View& view, const Options& options) {
  cv::Mat kept = options.bright ? cv::Mat(pixels > value) : cv::Mat(pixels <= value);
  if (!view.mask.empty()) kept.setTo(0, view.mask == 0);
  open_mask(kept, options);
  cv::Mat labels, figures, centres;
  const int count = cv::connectedComponentsWithStats(kept, labels, figures, centres, 8, CV_32S);
  const auto area = [&](int region) { return figures.at<int>(region, cv::CC_STAT_AREA); };
  std::vector<int> chosen;
  for (int region = 1; region < count; ++region) {
    const auto at = [&](int what) { return figures.at<int>(region, what); };
    const int left = at(cv::CC_STAT_LEFT), top = at(cv::CC_STAT_TOP);
    const bool is_cut =
        left == 0 || top == 0 || left + at(cv::CC_STAT_WIDTH) == kept.cols || top + at(cv::CC_STAT_HEIGHT) == kept.rows;
    if (area(region) >= 0.01 * options.least_percent * double(kept.total()) && (options.at_border || !is_cut))
      chosen.push_back(region);
  }
  std::stable_sort(chosen.begin(), chosen.end(), [&](int a, int b) { return area(a) > area(b); });
  std::vector<cv::Mat> regions;
  for (const int region : chosen) regions.push_back(labels == region);
  return regions;
}

/// The wanted region at the given value, or at the first of Otsu's values where there is one: he divides the grey
/// values, then again and again those of the side that counts.
std::optional<cv::Mat> region_of(const View& view, const Options& options, const Context& context) {
  cv::Mat pixels;
  view.image.pixels.convertTo(pixels, CV_16U);
  std::vector<std::uint16_t> values;
  if (options.grey_value == 0) values = values_of(pixels, view, options);
  for (int i = 0; i < (options.grey_value > 0 ? 1 : options.times); ++i) {
    double value = options.grey_value;
    if (value == 0) {
      if (values.empty()) break;
      cv::Mat ignored;
      value = cv::threshold(cv::Mat(1, int(values.size()), CV_16U, values.data()), ignored, 0, 65535,
                            cv::THRESH_BINARY | cv::THRESH_OTSU);
      std::erase_if(values, [&](std::uint16_t one) { return options.bright == (one <= value); });
    }
    const std::vector<cv::Mat> regions = regions_at(value, pixels, view, options);
    if (regions.size() < std::size_t(options.region)) continue;
    context.info(formatted("view '{}': region {} of {} {} {:.0f}", view.name, options.region, regions.size(),
                           options.bright ? "above" : "up to", value));
    return regions[std::size_t(options.region - 1)];
  }
  return std::nullopt;
}

View threshold(const View& view, const Options& options, Context& context) {
  check_view(view);
  const std::optional<cv::Mat> region = region_of(view, options, context);
  if (!region)
    throw Error(formatted("mask.threshold: view '{}': no grey value gives {}{}; give a grey_value, or another mask",
                          view.name, counted(std::size_t(options.region), "region"),
                          options.at_border ? "" : " away from the image's border"));
  View result = view;
  result.mask = *region;
  return result;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("mask.threshold", threshold)
      .summary("Keeps only what stands out by its grey value, such as an implant of metal")
      .in("view", "X-ray view")
      .out("view", "the same view; its mask is not 0 in this region only, and is 0 where it was 0 before")
      .trait("keeps_what_it_finds")
      .option("grey_value", &Options::grey_value, "the darkest pixels up to this value count; 0: it is found",
              at_least(0), at_most(65535))
      .option("times", &Options::times,
              "how often Otsu's method may divide the grey values, each time those of the side that counts, until "
              "there is such a region (IEEE Trans SMC 1979)",
              at_least(1), at_most(10))
      .option("bright", &Options::bright, "the brightest pixels count, those above the value")
      .option("opening_px", &Options::opening_px, "what is narrower than twice this, such as a cable, is cut off",
              at_least(0), at_most(100))
      .option("least_percent", &Options::least_percent, "regions smaller than this part of the image do not count",
              at_least(0), at_most(100))
      .option("at_border", &Options::at_border, "regions that touch the image's border count, too")
      .option("region", &Options::region, "which of the regions counts: 1 is the largest", at_least(1), at_most(1000));
}
