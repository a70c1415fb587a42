// SPDX-License-Identifier: Apache-2.0
#include "marrow/edges/refine.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

namespace marrow::edges {
namespace {

struct Found {
  int pixel;       ///< row-major index of the pixel in which the edge lies
  float distance;  ///< from the pixel at which the edge was found
  EdgePixel edge;
};

Found refine(const Prepared& image, const Gradient& gradient, int u, int v, float way) {
  const float du = gradient.du.at<float>(v, u), dv = gradient.dv.at<float>(v, u), length = std::hypot(du, dv);
  way = std::clamp(way, -1.0f, 1.0f);
  Found found;
  found.distance = std::abs(way);
  EdgePixel& edge = found.edge;
  const float in_gradient_u = float(u) + way * du / length, in_gradient_v = float(v) + way * dv / length;
  edge.u_px = in_gradient_u + gradient.offset_px;
  edge.v_px = in_gradient_v + gradient.offset_px;
  float du_there = bilinear(gradient.du, in_gradient_u, in_gradient_v),
        dv_there = bilinear(gradient.dv, in_gradient_u, in_gradient_v);
  if (du_there == 0 && dv_there == 0) du_there = du, dv_there = dv;
  const float magnitude = std::hypot(du_there, dv_there);
  edge.direction_u = du_there / magnitude;
  edge.direction_v = dv_there / magnitude;
  edge.magnitude = magnitude / image.slope(bilinear(image.values, edge.u_px, edge.v_px));
  found.pixel = int(std::lround(edge.v_px)) * image.values.cols + int(std::lround(edge.u_px));
  return found;
}

}  // namespace

std::optional<float> way_to_ridge(const Gradient& gradient, int u, int v) {
  const float du = gradient.du.at<float>(v, u), dv = gradient.dv.at<float>(v, u), length = std::hypot(du, dv);
  if (!(length > 0)) return std::nullopt;
  // Where the image is constant, the logarithm has no limit: the foot of an edge would look like a ridge.
  const float least = 0.01f * length;
  float z[3][3];
  for (int row = -1; row <= 1; ++row)
    for (int column = -1; column <= 1; ++column)
      z[row + 1][column + 1] = std::log(std::max(gradient.magnitude.at<float>(v + row, u + column), least));
  const auto column_sum = [&](int column) { return z[0][column] + z[1][column] + z[2][column]; };
  const auto row_sum = [&](int row) { return z[row][0] + z[row][1] + z[row][2]; };
  const float z_u = (column_sum(2) - column_sum(0)) / 6, z_v = (row_sum(2) - row_sum(0)) / 6;
  const float z_uu = (column_sum(2) + column_sum(0) - 2 * column_sum(1)) / 3;
  const float z_vv = (row_sum(2) + row_sum(0) - 2 * row_sum(1)) / 3;
  const float z_uv = (z[2][2] + z[0][0] - z[2][0] - z[0][2]) / 4;
  const float n_u = du / length, n_v = dv / length;
  const float curvature = z_uu * n_u * n_u + 2 * z_uv * n_u * n_v + z_vv * n_v * n_v;
  if (!(curvature < 0)) return std::nullopt;
  return -(z_u * n_u + z_v * n_v) / curvature;
}

bool passes(const Gradient& gradient, std::optional<float> way, int u, int v) {
  if (!way) return false;
  const float steepest = std::max(std::abs(gradient.du.at<float>(v, u)), std::abs(gradient.dv.at<float>(v, u)));
  return std::abs(*way) * steepest <= 0.6f * gradient.magnitude.at<float>(v, u);
}

float bilinear(const cv::Mat& values, float u, float v) {
  const int left = std::clamp(int(std::floor(u)), 0, values.cols - 2),
            top = std::clamp(int(std::floor(v)), 0, values.rows - 2);
  const float right_part = u - float(left), lower_part = v - float(top);
  const float* upper = values.ptr<float>(top) + left;
  const float* lower = values.ptr<float>(top + 1) + left;
  return (1 - lower_part) * ((1 - right_part) * upper[0] + right_part * upper[1]) +
         lower_part * ((1 - right_part) * lower[0] + right_part * lower[1]);
}

EdgeMap refined(const Prepared& image, const Gradient& gradient, const cv::Mat& marked, const WayToEdge& way) {
  const int rows = marked.rows;
  const auto way_at = [&](int u, int v) { return (way ? way(u, v) : way_to_ridge(gradient, u, v)).value_or(0.0f); };
  std::vector<std::vector<Found>> found_in_row(rows);
  tbb::parallel_for(0, rows, [&](int v) {
    const uchar* marks = marked.ptr<uchar>(v);
    for (int u = 0; u < marked.cols; ++u)
      if (marks[u] && gradient.magnitude.at<float>(v, u) > 0)
        found_in_row[v].push_back(refine(image, gradient, u, v, way_at(u, v)));
  });
  std::vector<Found> found;
  for (const auto& row : found_in_row) found.insert(found.end(), row.begin(), row.end());
  std::stable_sort(found.begin(), found.end(), [](const Found& a, const Found& b) {
    return a.pixel != b.pixel ? a.pixel < b.pixel : a.distance < b.distance;
  });
  EdgeMap edges;
  edges.width_px = marked.cols;
  edges.height_px = marked.rows;
  for (std::size_t i = 0; i < found.size(); ++i)
    if (i == 0 || found[i].pixel != found[i - 1].pixel) edges.pixels.push_back(found[i].edge);
  return edges;
}

}  // namespace marrow::edges
