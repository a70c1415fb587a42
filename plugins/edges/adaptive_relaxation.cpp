// SPDX-License-Identifier: Apache-2.0
// The chapter's edge extraction (3.2) in three steps: hysteresis thresholds at the 50th and 75th percentile of the
// gradient's magnitude in a local window, recursive relaxation of the pixels between them, removal of small components.
// Even in a flat window, a quarter of all pixels lies above the 75th percentile. So both thresholds have a lower limit:
// the window's median plus a multiple of the measured noise. The median is added because noise makes ridges also on the
// smooth slope of a round thigh, where the gradient is not 0.
#include <tbb/parallel_for.h>

#include "marrow/edges/threshold.hpp"

namespace {

using namespace marrow::edges;

struct Options {
  double sigma_px = 1.5;
  bool logarithm = true;
  double low = 50, high = 75;
  int window_px = 80;
  double noise_low = 2, noise_high = 4;
  bool thin = true;
  double magnitude_tolerance = 0.5;
  double direction_tolerance_deg = 30;
  int min_pixels = 20;
};

/// Thresholds at the centres of the blocks (CV_32F).
struct Thresholds {
  cv::Mat low, high;
};

Thresholds local_thresholds(const Prepared& image, const Gradient& gradient, const Options& options) {
  const cv::Mat noise = block_noise(image, gradient);
  const auto [median, low, high] =
      window_percentiles(gradient, image.usable, options.window_px, {50, options.low, options.high});
  return {cv::max(low, median + options.noise_low * noise), cv::max(high, median + options.noise_high * noise)};
}

enum Label : uchar { kNone = 0, kIntermediate = 1, kEdge = 2 };

cv::Mat classified(const Prepared& image, const Gradient& gradient, const Thresholds& thresholds, bool thin) {
  const int rows = image.values.rows, columns = image.values.cols;
  cv::Mat labels(rows, columns, CV_8U, cv::Scalar(kNone));
  tbb::parallel_for(1, rows - 1, [&](int v) {
    std::vector<float> low(columns), high(columns);
    interpolate_row(thresholds.low, v, low);
    interpolate_row(thresholds.high, v, high);
    const float* magnitude = gradient.magnitude.ptr<float>(v);
    const uchar* use = image.usable.ptr<uchar>(v);
    uchar* label = labels.ptr<uchar>(v);
    for (int u = 1; u < columns - 1; ++u) {
      if (!use[u] || !(magnitude[u] > low[u]) || (thin && !passes(gradient, way_to_ridge(gradient, u, v), u, v)))
        continue;
      label[u] = magnitude[u] > high[u] ? kEdge : kIntermediate;
    }
  });
  return labels;
}

/// Calls function(u, v) for the eight neighbours. Labels are never set on the image's border, so all neighbours exist.
template <class Function>
void for_neighbours(const cv::Point& pixel, Function function) {
  for (int v = pixel.y - 1; v <= pixel.y + 1; ++v)
    for (int u = pixel.x - 1; u <= pixel.x + 1; ++u)
      if (u != pixel.x || v != pixel.y) function(u, v);
}

/// Calls function(u, v) for the pixels labelled as edges, row by row. The function may change labels of later pixels.
template <class Function>
void for_edges(const cv::Mat& labels, Function function) {
  for (int v = 0; v < labels.rows; ++v) {
    const uchar* row = labels.ptr<uchar>(v);
    const void* found = row;
    while ((found = std::memchr(found, kEdge, std::size_t(row + labels.cols - static_cast<const uchar*>(found))))) {
      function(int(static_cast<const uchar*>(found) - row), v);
      found = static_cast<const uchar*>(found) + 1;
    }
  }
}

/// Makes an intermediate pixel an edge pixel if a neighbouring edge pixel has similar magnitude and direction, again
/// and again. The result does not depend on the order.
void relax(const Gradient& gradient, const Options& options, cv::Mat& labels) {
  const float cosine = float(std::cos(marrow::radians(options.direction_tolerance_deg)));
  std::vector<cv::Point> edge;
  for_edges(labels, [&](int u, int v) { edge.emplace_back(u, v); });
  while (!edge.empty()) {
    const cv::Point pixel = edge.back();
    edge.pop_back();
    const float du = gradient.du.at<float>(pixel), dv = gradient.dv.at<float>(pixel),
                magnitude = gradient.magnitude.at<float>(pixel);
    for_neighbours(pixel, [&](int u, int v) {
      if (labels.at<uchar>(v, u) != kIntermediate) return;
      const float other = gradient.magnitude.at<float>(v, u);
      const float inner = du * gradient.du.at<float>(v, u) + dv * gradient.dv.at<float>(v, u);
      if (std::abs(magnitude - other) > float(options.magnitude_tolerance) * std::max(magnitude, other)) return;
      if (inner < cosine * magnitude * other) return;
      labels.at<uchar>(v, u) = kEdge;
      edge.emplace_back(u, v);
    });
  }
}

/// Marks the edge pixels of 8-connected components of at least `min_pixels` pixels with 255. Removes all edges from
/// `labels`.
cv::Mat large_components(cv::Mat& labels, int min_pixels) {
  cv::Mat kept(labels.size(), CV_8U, cv::Scalar(0));
  std::vector<cv::Point> component;
  for_edges(labels, [&](int u, int v) {
    component.assign(1, {u, v});
    labels.at<uchar>(v, u) = kNone;
    for (std::size_t i = 0; i < component.size(); ++i) {
      const cv::Point pixel = component[i];
      for_neighbours(pixel, [&](int next_u, int next_v) {
        if (labels.at<uchar>(next_v, next_u) != kEdge) return;
        labels.at<uchar>(next_v, next_u) = kNone;
        component.emplace_back(next_u, next_v);
      });
    }
    if (int(component.size()) >= min_pixels)
      for (const cv::Point& pixel : component) kept.at<uchar>(pixel) = 255;
  });
  return kept;
}

marrow::EdgeMap adaptive_relaxation(const marrow::View& view, const Options& options, marrow::Context& context) {
  const Prepared image = prepare(view, options.sigma_px, options.logarithm, context);
  const Gradient gradient = gaussian_gradient(image.values, options.sigma_px);
  const Thresholds thresholds = local_thresholds(image, gradient, options);
  cv::Mat labels = classified(image, gradient, thresholds, options.thin);
  relax(gradient, options, labels);
  return refined(image, gradient, large_components(labels, options.min_pixels));
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("edges.adaptive_relaxation", adaptive_relaxation)
      .summary(
          "Edges by local percentile thresholds, relaxation and removal of small components (section 3.2 of the "
          "chapter)")
      .in("view", "X-ray view")
      .out("edges", "edge pixels at sub-pixel positions")
      .option("sigma_px", &Options::sigma_px, "standard deviation of the Gaussian derivative", marrow::at_least(0.7),
              marrow::at_most(10))
      .option("logarithm", &Options::logarithm,
              "find edges of the attenuation (logarithm of the grey value) instead of the grey value")
      .option("low", &Options::low, "lower threshold: percentile of the gradient's magnitude in the window",
              marrow::unit("%"), marrow::at_least(0), marrow::at_most(100))
      .option("high", &Options::high, "upper threshold: percentile of the gradient's magnitude in the window",
              marrow::unit("%"), marrow::at_least(0), marrow::at_most(100))
      .relation(marrow::not_above("low", "high"))
      .option("window_px", &Options::window_px, "side of the local window, rounded down to an odd multiple of 16",
              marrow::at_least(16))
      .option("noise_low", &Options::noise_low,
              "least value of the lower threshold: the window's median plus this many standard deviations of the noise",
              marrow::at_least(0))
      .option("noise_high", &Options::noise_high,
              "least value of the upper threshold: the window's median plus this many standard deviations of the noise",
              marrow::at_least(0))
      .option("thin", &Options::thin, "keep only pixels on the ridge of the gradient's magnitude")
      .option("magnitude_tolerance", &Options::magnitude_tolerance,
              "relaxation: largest difference of two magnitudes, as a fraction of the larger one", marrow::at_least(0),
              marrow::at_most(1))
      .option("direction_tolerance_deg", &Options::direction_tolerance_deg,
              "relaxation: largest angle between two gradients", marrow::at_least(0), marrow::at_most(180))
      .option("min_pixels", &Options::min_pixels, "connected components with fewer pixels are removed",
              marrow::at_least(1));
}
