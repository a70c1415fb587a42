// SPDX-License-Identifier: Apache-2.0
#include "marrow/similarity/blur.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "marrow/domain/quantile.hpp"
#include "marrow/toolbox/image/grey_values.hpp"

namespace marrow::image {
namespace {

constexpr int kReach = 24;                                // samples to each side of an edge
constexpr double kStep_px = 0.5;                          // between samples
constexpr double kFine_px = 1.5, kCoarse_px = 3;          // standard deviations of the two smoothings
constexpr std::array<double, 3> kLines_px{-1.5, 0, 1.5};  // parallel profiles, along the edge

/// The derivative of a Gaussian at the samples.
std::vector<double> slope_weights(double sigma_px) {
  std::vector<double> weights;
  for (int i = -kReach; i <= kReach; ++i) {
    const double t = i * kStep_px / sigma_px;
    weights.push_back(t * std::exp(-0.5 * t * t) / (sigma_px * sigma_px));
  }
  return weights;
}

double grey_at(const cv::Mat& image, int row, int column) {
  switch (image.depth()) {
    case CV_8U:
      return image.at<std::uint8_t>(row, column);
    case CV_16U:
      return image.at<std::uint16_t>(row, column);
    case CV_16S:
      return image.at<std::int16_t>(row, column);
    case CV_32F:
      return double(image.at<float>(row, column));
    default:
      return image.at<double>(row, column);
  }
}

double bilinear_grey(const cv::Mat& image, double u, double v) {
  const int column = int(u), row = int(v);
  const double x = u - column, y = v - row;
  return (1 - y) * ((1 - x) * grey_at(image, row, column) + x * grey_at(image, row, column + 1)) +
         y * ((1 - x) * grey_at(image, row + 1, column) + x * grey_at(image, row + 1, column + 1));
}

/// Line integrals across an edge, the mean of parallel lines. Empty near the image's border.
std::vector<double> profile_across(const cv::Mat& image, const GreyScale& scale, const EdgePixel& edge) {
  const double du = double(edge.direction_u), dv = double(edge.direction_v), margin = kReach * kStep_px + 3;
  const double u0 = double(edge.u_px), v0 = double(edge.v_px);
  if (!(u0 > margin && v0 > margin && u0 < image.cols - 1 - margin && v0 < image.rows - 1 - margin)) return {};
  std::vector<double> profile;
  for (int i = -kReach; i <= kReach; ++i) {
    double sum = 0;
    for (const double along : kLines_px)
      sum += scale.line_integral(
          bilinear_grey(image, u0 + i * kStep_px * du - along * dv, v0 + i * kStep_px * dv + along * du));
    profile.push_back(sum);
  }
  return profile;
}

/// The blur of a step with this profile. Absent if it is not one.
std::optional<double> blur_of(const std::vector<double>& profile) {
  static const std::vector<double> fine = slope_weights(kFine_px), coarse = slope_weights(kCoarse_px);
  double before = 0, after = 0;
  for (std::size_t i = 0; i < profile.size(); ++i) {
    before += fine[i] * profile[i];
    after += coarse[i] * profile[i];
  }
  const double ratio2 = before * before / (after * after);
  if (!(before * after > 0) || !(ratio2 > 1)) return std::nullopt;
  return std::sqrt(std::max(0.0, (kCoarse_px * kCoarse_px - ratio2 * kFine_px * kFine_px) / (ratio2 - 1)));
}

}  // namespace

double blur_px(const cv::Mat& image, const EdgeMap& edges) {
  constexpr std::size_t kMost = 400, kLeast = 20;
  if (edges.pixels.empty() || image.empty()) return 0;
  std::vector<float> magnitudes;
  for (const EdgePixel& edge : edges.pixels) magnitudes.push_back(edge.magnitude);
  const double middle = quantile_in_place(magnitudes, 0.5);
  const GreyScale scale(image);
  const std::size_t step = std::max<std::size_t>(1, edges.pixels.size() / 2 / kMost);
  std::vector<double> blurs;
  std::size_t strong = 0;
  for (const EdgePixel& edge : edges.pixels) {
    if (edge.magnitude < middle || strong++ % step != 0) continue;
    const std::vector<double> profile = profile_across(image, scale, edge);
    if (profile.empty()) continue;
    if (const auto blur = blur_of(profile)) blurs.push_back(*blur);
  }
  if (blurs.size() < kLeast) return 0;
  return quantile_in_place(blurs, 0.5);
}

}  // namespace marrow::image
