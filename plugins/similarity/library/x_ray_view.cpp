// SPDX-License-Identifier: Apache-2.0
#include "marrow/similarity/x_ray_view.hpp"

#include <algorithm>
#include <cmath>
#include <random>

#include "marrow/toolbox/image/grey_values.hpp"

namespace marrow::analytic {
namespace {

cv::Mat smoothed(const cv::Mat& image, double sigma) {
  const int reach = int(std::ceil(3 * sigma));
  std::vector<double> kernel;
  for (int i = -reach; i <= reach; ++i) kernel.push_back(std::exp(-0.5 * i * i / (sigma * sigma)));
  cv::Mat result = image;
  for (const bool across : {true, false}) {
    const cv::Mat from = result.clone();
    result = cv::Mat(from.size(), CV_32F);
    for (int v = 0; v < from.rows; ++v)
      for (int u = 0; u < from.cols; ++u) {
        double sum = 0, weights = 0;
        for (int i = -reach; i <= reach; ++i) {
          const int x = std::clamp(across ? u + i : u, 0, from.cols - 1),
                    y = std::clamp(across ? v : v + i, 0, from.rows - 1);
          sum += kernel[std::size_t(i + reach)] * double(from.at<float>(y, x));
          weights += kernel[std::size_t(i + reach)];
        }
        result.at<float>(v, u) = float(sum / weights);
      }
  }
  return result;
}

}  // namespace

View x_ray_view(const XRay& x_ray, const std::string& name, const RadiographProjector& body,
                const RigidTransform& world_from_model) {
  constexpr double kBrightest = 40000, kPerMm = 0.02, kBlur_px = 0.8, kTissue_mm = 90;
  const Camera& camera = x_ray.camera;
  const std::vector<float> bone =
      body.radiograph(camera, world_from_model, PixelGrid{0, 0, 1, camera.width_px, camera.height_px});
  cv::Mat pixels(camera.height_px, camera.width_px, CV_32F);
  for (int v = 0; v < pixels.rows; ++v)
    for (int u = 0; u < pixels.cols; ++u) {
      const double across = (u - 0.45 * pixels.cols) / pixels.cols,
                   tissue = kTissue_mm * std::sqrt(1 - across * across);
      const double integral = kPerMm * (tissue - 0.8 * kTissue_mm +
                                        double(bone[std::size_t(v) * std::size_t(pixels.cols) + std::size_t(u)]));
      pixels.at<float>(v, u) = float(kBrightest * std::exp(-x_ray.gain * integral - x_ray.offset));
    }
  pixels = smoothed(pixels, kBlur_px);
  View view{name, {}, camera, {}};
  if (x_ray.noise <= 0) {
    view.image.pixels = pixels;
    return view;
  }
  std::mt19937 random(x_ray.seed + 17);
  view.image.pixels = cv::Mat(pixels.size(), CV_16U);
  for (int v = 0; v < pixels.rows; ++v)
    for (int u = 0; u < pixels.cols; ++u) {
      double normal = -6;
      for (int i = 0; i < 12; ++i) normal += double(random()) / 4294967296.0;
      view.image.pixels.at<std::uint16_t>(v, u) = std::uint16_t(
          std::clamp(double(pixels.at<float>(v, u)) + 0.005 * kBrightest * x_ray.noise * normal, 1.0, 65535.0));
    }
  return view;
}

EdgeMap edges_of(const View& view) {
  constexpr double kSigma_px = 1.4;
  constexpr float kThreshold = 0.1f;  // as a fraction of the steepest gradient
  const cv::Mat values = smoothed(-image::line_integrals(view.image.pixels), kSigma_px);
  cv::Mat du(values.size(), CV_32F, cv::Scalar(0)), dv = du.clone(), magnitude = du.clone();
  float steepest = 0;
  for (int v = 1; v + 1 < values.rows; ++v)
    for (int u = 1; u + 1 < values.cols; ++u) {
      const float x = 0.5f * (values.at<float>(v, u + 1) - values.at<float>(v, u - 1)),
                  y = 0.5f * (values.at<float>(v + 1, u) - values.at<float>(v - 1, u));
      du.at<float>(v, u) = x;
      dv.at<float>(v, u) = y;
      magnitude.at<float>(v, u) = std::hypot(x, y);
      steepest = std::max(steepest, std::hypot(x, y));
    }
  const auto between = [&](float u, float v) {
    const int x = int(u), y = int(v);
    const float a = u - float(x), b = v - float(y);
    return (1 - b) * ((1 - a) * magnitude.at<float>(y, x) + a * magnitude.at<float>(y, x + 1)) +
           b * ((1 - a) * magnitude.at<float>(y + 1, x) + a * magnitude.at<float>(y + 1, x + 1));
  };
  EdgeMap map{values.cols, values.rows, {}};
  for (int v = 4; v + 4 < values.rows; ++v)
    for (int u = 4; u + 4 < values.cols; ++u) {
      const float here = magnitude.at<float>(v, u);
      if (!(here > kThreshold * steepest)) continue;
      const float x = du.at<float>(v, u) / here, y = dv.at<float>(v, u) / here;
      const float before = between(float(u) - x, float(v) - y), after = between(float(u) + x, float(v) + y),
                  bend = before - 2 * here + after;
      if (here < before || here <= after || !(bend < 0)) continue;
      const float off = std::clamp(0.5f * (before - after) / bend, -0.49f, 0.49f);
      map.pixels.push_back({float(u) + off * x, float(v) + off * y, x, y, here});
    }
  return map;
}

}  // namespace marrow::analytic
