// SPDX-License-Identifier: Apache-2.0
// OpenCV's version of Canny's detector (IEEE TPAMI 1986) on a Gaussian gradient. The median of a window is subtracted
// from the gradient's magnitude, and the rest is divided by the noise. So the same thresholds fit 8 bit and 16 bit
// images, bright and dark parts, and the smooth slope of a round thigh, where noise makes ridges.
#include <tbb/parallel_for.h>

#include <opencv2/imgproc.hpp>

#include "marrow/edges/threshold.hpp"

namespace {

using namespace marrow::edges;

struct Options {
  double sigma_px = 1.5;
  bool logarithm = true;
  int window_px = 80;
  double noise_low = 2, noise_high = 5;
};

constexpr float kUnit = 64;  // one standard deviation of the noise in the 16 bit gradient that OpenCV needs

marrow::EdgeMap canny(const marrow::View& view, const Options& options, marrow::Context& context) {
  const Prepared image = prepare(view, options.sigma_px, options.logarithm, context);
  const Gradient gradient = gaussian_gradient(image.values, options.sigma_px);
  const cv::Mat noise = block_noise(image, gradient);
  const cv::Mat median = window_percentiles(gradient, image.usable, options.window_px, {50, 50, 50})[0];
  double steepest = 0;
  cv::minMaxLoc(gradient.magnitude, nullptr, &steepest);
  const float largest_scale = float(32000 / std::max(steepest, 1e-30));  // 16 bits must hold the steepest gradient
  cv::Mat du(image.values.size(), CV_16S), dv(image.values.size(), CV_16S);
  tbb::parallel_for(0, image.values.rows, [&](int v) {
    std::vector<float> noise_row(image.values.cols), median_row(image.values.cols);
    interpolate_row(noise, v, noise_row);
    interpolate_row(median, v, median_row);
    for (int u = 0; u < image.values.cols; ++u) {
      const float magnitude = gradient.magnitude.at<float>(v, u);
      const float above = magnitude > median_row[u] ? 1 - median_row[u] / magnitude : 0.0f;
      const float scale = above * std::min(kUnit / noise_row[u], largest_scale);
      du.at<short>(v, u) = cv::saturate_cast<short>(scale * gradient.du.at<float>(v, u));
      dv.at<short>(v, u) = cv::saturate_cast<short>(scale * gradient.dv.at<float>(v, u));
    }
  });
  cv::Mat marked;
  cv::Canny(du, dv, marked, options.noise_low * kUnit, options.noise_high * kUnit, true);
  marked.setTo(0, image.usable == 0);
  return refined(image, gradient, marked);
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("edges.canny", canny)
      .summary("Canny's edge detector (IEEE TPAMI 1986), thresholds in multiples of the image's noise")
      .in("view", "X-ray view")
      .out("edges", "edge pixels at sub-pixel positions")
      .option("sigma_px", &Options::sigma_px, "standard deviation of the Gaussian derivative", marrow::at_least(0.7),
              marrow::at_most(10))
      .option("logarithm", &Options::logarithm,
              "find edges of the attenuation (logarithm of the grey value) instead of the grey value")
      .option("window_px", &Options::window_px,
              "side of the window for the median, rounded down to an odd multiple of 16", marrow::at_least(16))
      .option("noise_low", &Options::noise_low,
              "lower hysteresis threshold: the window's median plus this many standard deviations of the noise",
              marrow::at_least(0))
      .option("noise_high", &Options::noise_high,
              "upper hysteresis threshold: the window's median plus this many standard deviations of the noise",
              marrow::at_least(0))
      .relation(marrow::not_above("noise_low", "noise_high"));
}
