#include <marrow/plugin.hpp>
#include <opencv2/imgproc.hpp>

namespace {
struct Options {
  int size_px = 5;
};

marrow::View median(const marrow::View& view, const Options& options) {
  marrow::View result = view;
  cv::medianBlur(view.image.pixels, result.image.pixels = cv::Mat(), options.size_px | 1);
  return result;
}

marrow::View mean(const marrow::View& view, const Options& options) {
  marrow::View result = view;
  cv::blur(view.image.pixels, result.image.pixels = cv::Mat(), {options.size_px, options.size_px});
  return result;
}
}  // namespace

MARROW_PLUGIN(plugin) {
  using Named = std::pair<const char*, decltype(&median)>;
  for (const auto& [name, function] : {Named{"denoise.median", median}, Named{"denoise.mean", mean}})
    plugin.node(name, function)
        .summary("Each pixel from those around it")
        .in("view", "X-ray view")
        .out("view", "smoothed")
        .option("size_px", &Options::size_px, "side of the square", marrow::at_least(1), marrow::at_most(5));
}
