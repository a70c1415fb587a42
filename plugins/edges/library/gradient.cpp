// SPDX-License-Identifier: Apache-2.0
#include "marrow/edges/gradient.hpp"

#include <tbb/parallel_for.h>

#include <marrow/domain/quantile.hpp>
#include <numeric>
#include <opencv2/imgproc.hpp>

#include "marrow/base/number_text.hpp"
#include "marrow/toolbox/image/field_of_view.hpp"
#include "marrow/toolbox/image/grey_values.hpp"

namespace marrow::edges {
namespace {

constexpr int kBandRows = 64;  // fixed, so that the result does not depend on the number of threads
constexpr int kBlock = 16;
constexpr int kMostBlocks = 1024;  // about the largest number of blocks in which noise is measured

/// Calls function(first row, end row) for bands of rows, in parallel.
template <class Function>
void for_bands(int rows, Function function) {
  tbb::parallel_for(0, (rows + kBandRows - 1) / kBandRows,
                    [&](int band) { function(band * kBandRows, std::min(rows, (band + 1) * kBandRows)); });
}

/// Standard deviation of Gaussian noise with the same median absolute deviation.
float deviation(std::vector<float>& values) {
  const float centre = float(quantile_in_place(values, 0.5));
  for (float& value : values) value = std::abs(value - centre);
  return 1.4826f * float(quantile_in_place(values, 0.5));
}

}  // namespace

Prepared prepare(const View& view, double sigma_px, bool logarithm, const Context& context) {
  check_view(view);
  const std::string what = "view '" + view.name + "'";
  const int type = view.image.pixels.type();
  if (type != CV_8UC1 && type != CV_16UC1 && type != CV_32FC1)
    throw Error(what + ": the image must have one channel of 8 or 16 bit whole numbers or 32 bit floats");
  cv::Mat grey;
  view.image.pixels.convertTo(grey, CV_32F);
  if (type == CV_32FC1 && !cv::checkRange(grey))
    throw Error(what + ": the image holds pixels that are not finite (NaN or infinity)");
  const image::GreyRange range = image::grey_range(grey);
  if (range.least == range.greatest)
    throw Error(formatted("{}: all pixels have the same value {:g}, so there is no edge; check the image file", what,
                          range.least));
  if (logarithm && range.greatest <= 0)
    throw Error(what + ": the image has no positive grey value, so its logarithm cannot be taken");
  image::warn_of_greys(view, context);
  if (range.beyond > 0) grey = cv::min(cv::max(grey, range.least), range.greatest);
  const double dark = range.dark(), smallest = range.least - dark, largest = range.greatest - dark;
  if (dark < 0) grey -= dark;
  Prepared prepared;
  prepared.usable = image::usable_pixels(view, grey, smallest, largest, int(std::ceil(3 * sigma_px)));
  if (cv::countNonZero(prepared.usable) == 0)
    throw Error(
        formatted("{}: no pixel is left to search for edges (mask, image border and smoothing take all of {} x {})",
                  what, grey.cols, grey.rows));
  prepared.whole_numbers = type != CV_32FC1;
  prepared.range = float(largest - smallest);
  prepared.logarithm = logarithm;
  prepared.brightest = float(largest);
  prepared.values = logarithm ? cv::Mat(-image::line_integrals(grey)) : grey;
  return prepared;
}

Kernel gaussian_kernel(double sigma_px, double reach) {
  const int radius = int(std::ceil(reach * sigma_px));
  Kernel kernel;
  double sum = 0, slope = 0;
  for (int i = -radius; i <= radius; ++i) {
    const double weight = std::exp(-0.5 * i * i / (sigma_px * sigma_px));
    kernel.smooth.push_back(float(weight));
    kernel.derive.push_back(float(i * weight));
    sum += weight;
    slope += i * i * weight;
  }
  for (float& weight : kernel.smooth) weight /= float(sum);    // a constant stays the same
  for (float& weight : kernel.derive) weight /= float(slope);  // a ramp of slope 1 gives 1
  return kernel;
}

Kernel smoothed_mask(const Kernel& mask, double sigma_px) {
  if (sigma_px == 0) return mask;
  const std::vector<float> gauss = gaussian_kernel(sigma_px).smooth;
  const auto convolved = [&](const std::vector<float>& weights) {
    std::vector<float> result(weights.size() + gauss.size() - 1, 0.0f);
    for (std::size_t i = 0; i < weights.size(); ++i)
      for (std::size_t k = 0; k < gauss.size(); ++k) result[i + k] += weights[i] * gauss[k];
    return result;
  };
  return {convolved(mask.smooth), convolved(mask.derive)};
}

Gradient gradient_of(const cv::Mat& values, const Kernel& kernel) {
  const auto norm = [](const std::vector<float>& weights) {
    return std::sqrt(std::inner_product(weights.begin(), weights.end(), weights.begin(), 0.0));
  };
  Gradient gradient;
  gradient.noise_gain = norm(kernel.smooth) * norm(kernel.derive);
  gradient.offset_px = kernel.smooth.size() % 2 ? 0.0f : 0.5f;
  for (cv::Mat* part : {&gradient.du, &gradient.dv, &gradient.magnitude}) part->create(values.size(), CV_32F);
  const cv::Point anchor(int(kernel.smooth.size() - 1) / 2, int(kernel.smooth.size() - 1) / 2);
  for_bands(values.rows, [&](int first, int end) {
    const cv::Mat band = values.rowRange(first, end);  // OpenCV's filter also reads rows beside the band
    cv::Mat du = gradient.du.rowRange(first, end), dv = gradient.dv.rowRange(first, end);
    cv::Mat magnitude = gradient.magnitude.rowRange(first, end);
    cv::sepFilter2D(band, du, CV_32F, kernel.derive, kernel.smooth, anchor);
    cv::sepFilter2D(band, dv, CV_32F, kernel.smooth, kernel.derive, anchor);
    cv::magnitude(du, dv, magnitude);
  });
  return gradient;
}

Gradient gaussian_gradient(const cv::Mat& values, double sigma_px) {
  return gradient_of(values, gaussian_kernel(sigma_px));
}

NoiseLevel::NoiseLevel(const Prepared& image, const Gradient& gradient) {
  const int columns = image.values.cols / kBlock, rows = image.values.rows / kBlock;
  const int step = columns * rows / kMostBlocks + 1;
  std::vector<std::pair<float, float>> blocks(std::size_t(columns) * rows, {0.0f, -1.0f});  // value, noise
  tbb::parallel_for(0, rows, [&](int row) {
    std::vector<float> du, dv;
    for (int column = 5 * row % step; column < columns; column += step) {
      du.clear(), dv.clear();
      double sum = 0;
      for (int v = row * kBlock; v < (row + 1) * kBlock; v += 2)  // every other pixel: noise of neighbours correlates
        for (int u = column * kBlock; u < (column + 1) * kBlock; u += 2) {
          if (!image.usable.at<uchar>(v, u)) continue;
          du.push_back(gradient.du.at<float>(v, u)), dv.push_back(gradient.dv.at<float>(v, u));
          sum += image.values.at<float>(v, u);
        }
      if (du.size() < kBlock * kBlock / 8) continue;
      const float value = float(sum / double(du.size()));
      blocks[std::size_t(row) * columns + column] = {value, std::min(deviation(du), deviation(dv))};
    }
  });
  std::erase_if(blocks, [](const auto& block) { return block.second < 0; });
  std::sort(blocks.begin(), blocks.end());

  // Rounding to whole grey values has the standard deviation 1 / sqrt(12). For images of floats, 1e-5 of their range is
  // used instead.
  const double rounding = (image.whole_numbers ? 0.29 : 1e-5 * image.range) * gradient.noise_gain;
  const std::size_t groups = std::clamp<std::size_t>(blocks.size() / 32, 1, 8);
  for (std::size_t group = 0; group < groups && !blocks.empty(); ++group) {
    std::vector<float> values, noises;
    for (std::size_t i = group * blocks.size() / groups; i < (group + 1) * blocks.size() / groups; ++i) {
      values.push_back(blocks[i].first);
      noises.push_back(blocks[i].second);
    }
    const float value = float(quantile_in_place(values, 0.5));
    const float least = float(rounding * image.slope(value));
    constexpr double kQuietest = 0.3;  // texture only adds to the noise
    noise_of_value_.emplace_back(value, std::max(least, float(quantile_in_place(noises, kQuietest))));
  }
  if (noise_of_value_.empty())
    noise_of_value_.emplace_back(0.0f, float(rounding * image.slope(image.values.at<float>(0, 0))));
}

float NoiseLevel::at(float value) const {
  const auto above = std::upper_bound(noise_of_value_.begin(), noise_of_value_.end(), std::pair(value, 0.0f));
  if (above == noise_of_value_.begin()) return above->second;
  const auto below = above - 1;
  if (above == noise_of_value_.end() || above->first <= below->first) return below->second;
  const float part = (value - below->first) / (above->first - below->first);
  return below->second + part * (above->second - below->second);
}

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
