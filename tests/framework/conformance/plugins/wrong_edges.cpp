// SPDX-License-Identifier: Apache-2.0
// A plain edge extractor, and five that are wrong in one way each: the suite must catch each of them.
#include <atomic>
#include <cstdlib>
#include <marrow/plugin.hpp>

namespace {

enum class Fault { none, shifted, turned, changing, unsorted, crashing };

float value_at(const cv::Mat& pixels, int v, int u) {
  switch (pixels.depth()) {
    case CV_8U:
      return pixels.at<std::uint8_t>(v, u);
    case CV_16U:
      return pixels.at<std::uint16_t>(v, u);
    default:
      return pixels.at<float>(v, u);
  }
}

/// The mean of 5 x 5 pixels.
cv::Mat smoothed(const cv::Mat& pixels) {
  cv::Mat smooth(pixels.rows, pixels.cols, CV_32F, cv::Scalar(0));
  for (int v = 2; v + 2 < pixels.rows; ++v)
    for (int u = 2; u + 2 < pixels.cols; ++u) {
      float sum = 0;
      for (int j = -2; j <= 2; ++j)
        for (int i = -2; i <= 2; ++i) sum += value_at(pixels, v + j, u + i);
      smooth.at<float>(v, u) = sum / 25;
    }
  return smooth;
}

/// Where the gradient along one axis is greatest and greater than 400 grey values a pixel, to sub-pixel precision.
marrow::EdgeMap steepest(const marrow::View& view) {
  const cv::Mat& pixels = view.image.pixels;
  if (pixels.empty()) throw marrow::Error("the image is empty");
  const cv::Mat smooth = smoothed(pixels);
  marrow::EdgeMap map{pixels.cols, pixels.rows, {}};
  const auto du = [&](int v, int u) { return 0.5f * (smooth.at<float>(v, u + 1) - smooth.at<float>(v, u - 1)); };
  const auto dv = [&](int v, int u) { return 0.5f * (smooth.at<float>(v + 1, u) - smooth.at<float>(v - 1, u)); };
  for (int v = 5; v + 5 < pixels.rows; ++v)
    for (int u = 5; u + 5 < pixels.cols; ++u) {
      const float gu = du(v, u), gv = dv(v, u), length = std::hypot(gu, gv);
      if (!(length > 400) || !std::isfinite(length)) continue;
      const bool across = std::abs(gu) >= std::abs(gv);
      const float before = across ? std::hypot(du(v, u - 1), dv(v, u - 1)) : std::hypot(du(v - 1, u), dv(v - 1, u));
      const float after = across ? std::hypot(du(v, u + 1), dv(v, u + 1)) : std::hypot(du(v + 1, u), dv(v + 1, u));
      if (before > length || after >= length) continue;
      const float shift = std::clamp(0.5f * (before - after) / (before - 2 * length + after), -0.5f, 0.5f);
      map.pixels.push_back({u + (across ? shift : 0), v + (across ? 0 : shift), gu / length, gv / length, length});
    }
  return map;
}

template <Fault fault>
marrow::EdgeMap extract(const marrow::View& view) {
  static std::atomic<int> calls{0};
  if (fault == Fault::crashing && view.image.pixels.total() < 100) std::abort();
  marrow::EdgeMap map = steepest(view);
  for (marrow::EdgePixel& pixel : map.pixels) {
    if (fault == Fault::shifted) pixel.u_px += 0.45f * pixel.direction_u, pixel.v_px += 0.45f * pixel.direction_v;
    if (fault == Fault::turned) pixel.direction_u = -pixel.direction_u, pixel.direction_v = -pixel.direction_v;
  }
  if (fault == Fault::shifted)  // still in order
    std::stable_sort(map.pixels.begin(), map.pixels.end(), [](const auto& a, const auto& b) {
      return std::pair(std::lround(a.v_px), std::lround(a.u_px)) < std::pair(std::lround(b.v_px), std::lround(b.u_px));
    });
  if (fault == Fault::changing && !map.pixels.empty()) map.pixels[0].magnitude += float(++calls);
  if (fault == Fault::unsorted) std::reverse(map.pixels.begin(), map.pixels.end());
  return map;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  const auto add = [&](const char* name, auto* function) {
    plugin.node(name, function).summary("For a test of the suite").in("view", "X-ray view").out("edges", "edge pixels");
  };
  add("edges.plain", extract<Fault::none>);
  add("edges.shifted", extract<Fault::shifted>);
  add("edges.turned", extract<Fault::turned>);
  add("edges.changing", extract<Fault::changing>);
  add("edges.unsorted", extract<Fault::unsorted>);
  add("edges.crashing", extract<Fault::crashing>);
}
