// SPDX-License-Identifier: Apache-2.0
#include "marrow/edges/threshold.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>

#include "marrow/edges/window.hpp"

namespace marrow::edges {

EdgeMap edges_above_noise(const Prepared& image, const Gradient& gradient, const ThresholdOptions& options,
                          const WayToEdge& way) {
  const cv::Mat median = window_percentiles(gradient, image.usable, options.window_px, {50, 50, 50})[0];
  const cv::Mat least = median + options.threshold * block_noise(image, gradient);
  const int rows = image.values.rows, columns = image.values.cols;
  cv::Mat marked(rows, columns, CV_8U, cv::Scalar(0));
  tbb::parallel_for(1, rows - 1, [&](int v) {
    std::vector<float> least_row(columns);
    interpolate_row(least, v, least_row);
    const float* magnitude = gradient.magnitude.ptr<float>(v);
    const uchar* use = image.usable.ptr<uchar>(v);
    for (int u = 1; u < columns - 1; ++u)
      if (use[u] && magnitude[u] > least_row[u] && passes(gradient, way(u, v), u, v)) marked.at<uchar>(v, u) = 255;
  });
  return refined(image, gradient, marked, way);
}

}  // namespace marrow::edges
