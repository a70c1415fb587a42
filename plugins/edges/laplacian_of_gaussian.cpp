// SPDX-License-Identifier: Apache-2.0
// Zero crossings of the Laplacian of a Gaussian (Marr and Hildreth, Proc. R. Soc. Lond. B 1980), at sub-pixel
// positions. Noise makes zero crossings everywhere, so a zero crossing counts only if the gradient there is
// significant. The Laplacian must fall along the gradient. Where it rises, the gradient has a minimum, not a maximum
// (Clark, IEEE TPAMI 1989).
#include <opencv2/imgproc.hpp>

#include "marrow/edges/threshold.hpp"

namespace {

using namespace marrow::edges;

// Radius of the kernels in sigma. Shorter kernels give false zero crossings beside a steep edge.
constexpr double kReach = 5;

/// Weights of the second derivative of a Gaussian. They give 0 for a constant or a ramp and 2 for the parabola x^2.
std::vector<float> second_derivative(double sigma_px, int radius) {
  const auto weight = [&](int i) {
    return std::exp(-0.5 * i * i / (sigma_px * sigma_px)) * (i * i - sigma_px * sigma_px);
  };
  double sum = 0, moment = 0;
  for (int i = -radius; i <= radius; ++i) sum += weight(i);
  std::vector<float> weights;
  for (int i = -radius; i <= radius; ++i) {
    weights.push_back(float(weight(i) - sum / (2 * radius + 1)));
    moment += i * i * double(weights.back());
  }
  for (float& one : weights) one *= float(2 / moment);
  return weights;
}

cv::Mat laplacian(const cv::Mat& values, double sigma_px) {
  const std::vector<float> smooth = gaussian_kernel(sigma_px, kReach).smooth;
  const std::vector<float> second = second_derivative(sigma_px, int(smooth.size() / 2));
  cv::Mat across, along;
  cv::sepFilter2D(values, across, CV_32F, second, smooth);
  cv::sepFilter2D(values, along, CV_32F, smooth, second);
  return across + along;
}

/// Distance along the gradient to the place where the Laplacian falls through zero. Nothing if it is more than a pixel
/// away.
std::optional<float> way_to_zero(const cv::Mat& laplacian, const Gradient& gradient, int u, int v) {
  const float du = gradient.du.at<float>(v, u), dv = gradient.dv.at<float>(v, u), length = std::hypot(du, dv);
  if (!(length > 0)) return std::nullopt;
  const float here = laplacian.at<float>(v, u), side = here > 0 ? 1.0f : -1.0f;
  const float there = bilinear(laplacian, float(u) + side * du / length, float(v) + side * dv / length);
  if (here * there > 0 || here == there) return std::nullopt;
  return side * here / (here - there);
}

marrow::EdgeMap laplacian_of_gaussian(const marrow::View& view, const ThresholdOptions& options,
                                      marrow::Context& context) {
  const Prepared image = prepare(view, options.sigma_px, options.logarithm, context);
  const Gradient gradient = gradient_of(image.values, gaussian_kernel(options.sigma_px, kReach));
  const cv::Mat values = laplacian(image.values, options.sigma_px);
  return edges_above_noise(image, gradient, options, [&](int u, int v) { return way_to_zero(values, gradient, u, v); });
}

}  // namespace

MARROW_PLUGIN(plugin) {
  declare_thresholds(
      plugin.node("edges.laplacian_of_gaussian", laplacian_of_gaussian)
          .summary("Zero crossings of the Laplacian of a Gaussian (Marr and Hildreth 1980) with a significant gradient")
          .option("sigma_px", &ThresholdOptions::sigma_px, "standard deviation of the Gaussian", marrow::at_least(1),
                  marrow::at_most(10)));
}
