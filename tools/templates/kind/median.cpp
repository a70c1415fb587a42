// The first node of the kind "new_kind".
#include <marrow/plugin.hpp>
#include <opencv2/imgproc.hpp>

namespace {
struct Options {
  int size_px = 3;
};

marrow::View median(const marrow::View& view, const Options& options) {
  marrow::View result = view;
  cv::medianBlur(view.image.pixels, result.image.pixels = cv::Mat(), options.size_px | 1);
  return result;
}
}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("new_kind.median", median)
      .summary("Each pixel becomes the median of those around it")
      .in("view", "X-ray view")
      .out("view", "the same with less noise")
      .option("size_px", &Options::size_px, "side of the square; an even number counts as the next odd one",
              marrow::at_least(1), marrow::at_most(5));
}
