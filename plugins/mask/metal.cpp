// SPDX-License-Identifier: Apache-2.0
// Metal attenuates far more than what surrounds it, so a threshold on the line integral above that of the surroundings
// finds it. A second, lower threshold follows it to its border (hysteresis, as in Canny's detector, IEEE TPAMI 1986).
// The field of a round collimator is found by its outline, as for edges.

#include "marrow/base/names.hpp"
#include "marrow/mask/leave_out.hpp"
#include "marrow/toolbox/image/field_of_view.hpp"
#include "marrow/toolbox/image/grey_values.hpp"

namespace {

using namespace marrow;

struct Options {
  std::vector<std::string> leave_out{"metal", "outside"};
  double contrast_low = 0.5, contrast_high = 1;
  double window_mm = 40;
  int margin_px = 3;
};

constexpr double kSteps = 255 / 5.3;  // line integrals are at most 5.3; OpenCV's median of a wide window takes 8 bits

/// By how much each line integral is above the median of its window; CV_32F. The image is reduced for the median, whose
/// window then has at most 101 pixels.
cv::Mat above_surroundings(const cv::Mat& line_integrals, double window_px) {
  const double step = std::max(1.0, window_px / 101);
  const int side = std::max(3, int(window_px / step) / 2 * 2 + 1);
  cv::Mat small, steps, median;
  cv::resize(line_integrals, small, {}, 1 / step, 1 / step, cv::INTER_AREA);
  small.convertTo(steps, CV_8U, kSteps);
  cv::medianBlur(steps, median, side);
  median.convertTo(median, CV_32F, 1 / kSteps);
  cv::resize(median, median, line_integrals.size(), 0, 0, cv::INTER_LINEAR);
  return line_integrals - median;
}

/// CV_8U, 255 in the connected parts above `low` that somewhere reach `high`.
cv::Mat by_hysteresis(const cv::Mat& values, double low, double high) {
  cv::Mat labels;
  const int count = cv::connectedComponents(values >= low, labels, 8, CV_32S);
  std::vector<std::uint8_t> reaches(std::size_t(count), 0);
  for (int v = 0; v < values.rows; ++v)
    for (int u = 0; u < values.cols; ++u)
      if (values.at<float>(v, u) >= high) reaches[std::size_t(labels.at<int>(v, u))] = 255;
  reaches[0] = 0;  // the background
  cv::Mat found(values.size(), CV_8U);
  for (int v = 0; v < values.rows; ++v)
    for (int u = 0; u < values.cols; ++u) found.at<uchar>(v, u) = reaches[std::size_t(labels.at<int>(v, u))];
  return found;
}

double window_px(const View& view, double window_mm) {
  const double depth_mm = view.camera.camera_from_world.translation_mm.z();
  if (depth_mm <= 0) throw Error("view '" + view.name + "': the world's origin lies behind the source");
  return window_mm * view.camera.intrinsics(0, 0) / depth_mm;
}

/// CV_32F. Throws Error for an image without content.
cv::Mat grey_of(const View& view) {
  cv::Mat grey;
  view.image.pixels.convertTo(grey, CV_32F);
  if (!cv::checkRange(grey))
    throw Error("view '" + view.name + "': the image holds pixels that are not finite (NaN or infinity)");
  const image::GreyRange range = image::grey_range(grey);
  if (range.least == range.greatest)
    throw Error("view '" + view.name +
                "': all pixels have the same value, so there is nothing to find; check the image file");
  return grey;
}

cv::Mat outside_of_field(const View& view, const cv::Mat& grey) {
  const image::GreyRange range = image::grey_range(grey);
  return image::usable_pixels(view, grey - range.dark(), range.least - range.dark(), range.greatest - range.dark(),
                              1) == 0;
}

View metal(const View& view, const Options& options, Context& context) {
  check_view(view);
  image::warn_of_greys(view, context);
  const cv::Mat grey = grey_of(view);
  cv::Mat left_out = cv::Mat::zeros(grey.size(), CV_8U);
  for (const std::string& what : options.leave_out) {
    if (what == "metal")
      left_out |= by_hysteresis(above_surroundings(image::line_integrals(grey), window_px(view, options.window_mm)),
                                options.contrast_low, options.contrast_high);
    else if (what == "outside")
      left_out |= outside_of_field(view, grey);
    else
      throw Error("option 'leave_out': '" + what + "' is neither metal nor outside; " +
                  suggestion(what, {"metal", "outside"}));
  }
  return mask::without(view, left_out, options.margin_px);
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("mask.metal", metal)
      .summary("Leaves out metal, which attenuates far more than its surroundings, and the outside of a round field")
      .in("view", "X-ray view")
      .out("view", "the same view; its mask is 0 where these are, and where it was 0 before")
      .option("leave_out", &Options::leave_out, "what does not count: metal, outside")
      .relation(at_least_one({"leave_out"}))
      .option("contrast_low", &Options::contrast_low,
              "metal: line integral above the median of the window, at its border", at_least(0))
      .option("contrast_high", &Options::contrast_high, "metal: the same, which it reaches somewhere", at_least(0))
      .relation(not_above("contrast_low", "contrast_high"))
      .option("window_mm", &Options::window_mm, "side of the window, at the world's origin; wider than the metal",
              at_least(1), at_most(1000))
      .option("margin_px", &Options::margin_px, "pixels this near are left out, too", at_least(0), at_most(100));
}
