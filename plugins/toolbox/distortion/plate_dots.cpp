// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/distortion/plate.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "marrow/domain/quantile.hpp"

namespace marrow::distortion {
namespace {

constexpr std::size_t kMostSpots = 20000;
constexpr double kUsualFactor = 1.3;  ///< a spot stands out by this many root mean squares of its neighbourhood
constexpr double kFloor = 0.2;        ///< of the 95th percentile of these: where nothing is, noise is no spot

cv::Mat1f blurred(const cv::Mat1f& image, double sigma) {
  cv::Mat1f result;
  cv::GaussianBlur(image, result, {0, 0}, sigma, sigma, cv::BORDER_REPLICATE);
  return result;
}

/// How much a pixel stands out: the difference of two Gaussians. A disc of radius r answers most if the Laplacian's
/// sigma is r / sqrt(2).
cv::Mat1f contrast_of(const cv::Mat1f& grey, double radius_px, bool is_bright) {
  const double sigma = std::max(0.6, radius_px / std::sqrt(2.0) / 1.25);
  const cv::Mat1f difference = blurred(grey, sigma) - blurred(grey, 1.6 * sigma);
  return is_bright ? difference : cv::Mat1f(-difference);
}

/// The root mean square of the contrast in the neighbourhood of each pixel, not below the floor.
cv::Mat1f usual_of(const cv::Mat1f& contrast, double radius_px) {
  const int width = 2 * int(std::ceil(8 * radius_px)) + 1;
  cv::Mat1f usual;
  cv::boxFilter(contrast.mul(contrast), usual, CV_32F, {width, width}, {-1, -1}, true, cv::BORDER_REPLICATE);
  cv::sqrt(cv::max(usual, 0.f), usual);
  std::vector<float> sorted(usual.begin(), usual.end());
  return cv::max(usual, float(kFloor * quantile_in_place(sorted, 0.95)));
}

bool is_largest(const cv::Mat1f& contrast, int v, int u, int reach) {
  const float value = contrast(v, u);
  for (int y = v - reach; y <= v + reach; ++y)
    for (int x = u - reach; x <= u + reach; ++x) {
      if (contrast(y, x) > value) return false;
      if (contrast(y, x) == value && (y < v || (y == v && x < u))) return false;
    }
  return true;
}

/// The maximum of the parabola through the logarithms of 3 x 3 values, which is exact for a Gaussian; of the values
/// themselves if one of them is not positive. The pixel itself, not round, if the parabola has no maximum nearby.
Spot refined(const cv::Mat1f& contrast, int v, int u) {
  double values[3][3];
  bool is_positive = true;
  for (int y = 0; y < 3; ++y)
    for (int x = 0; x < 3; ++x) {
      values[y][x] = double(contrast(v + y - 1, u + x - 1));
      is_positive &= values[y][x] > 0;
    }
  if (is_positive)
    for (auto& row : values)
      for (double& value : row) value = std::log(value);
  // Least squares of a + b x + c y + d x^2 + e x y + f y^2 over the nine pixels.
  double b = 0, c = 0, d = 0, e = 0, f = 0;
  for (int y = -1; y <= 1; ++y)
    for (int x = -1; x <= 1; ++x) {
      const double value = values[y + 1][x + 1];
      b += value * x / 6;
      c += value * y / 6;
      d += value * (x * x / 2.0 - 1 / 3.0);
      f += value * (y * y / 2.0 - 1 / 3.0);
      e += value * x * y / 4;
    }
  const Eigen::Vector2d at(u, v);
  const double strength = double(contrast(v, u)), determinant = 4 * d * f - e * e;
  if (!(determinant > 0) || !(d < 0)) return {at, strength, 0};
  const Eigen::Vector2d off((e * c - 2 * f * b) / determinant, (e * b - 2 * d * c) / determinant);
  if (off.cwiseAbs().maxCoeff() > 1) return {at, strength, 0};
  const double mean = -0.5 * (d + f), half_difference = 0.5 * std::hypot(d - f, e);
  return {at + off, strength, (mean - half_difference) / (mean + half_difference)};
}

}  // namespace

std::vector<Spot> find_spots(const cv::Mat1f& grey, double radius_px, bool is_bright) {
  const cv::Mat1f contrast = contrast_of(grey, radius_px, is_bright), usual = usual_of(contrast, radius_px);
  const int reach = std::max(1, int(std::lround(0.8 * radius_px)));
  std::vector<Spot> spots;
  for (int v = reach; v < grey.rows - reach; ++v)
    for (int u = reach; u < grey.cols - reach; ++u)
      if (contrast(v, u) > kUsualFactor * usual(v, u) && is_largest(contrast, v, u, reach))
        spots.push_back(refined(contrast, v, u));
  if (spots.size() > kMostSpots) {
    std::stable_sort(spots.begin(), spots.end(), [](const Spot& a, const Spot& b) { return a.strength > b.strength; });
    spots.resize(kMostSpots);
  }
  const Eigen::Vector2d middle(0.5 * (grey.cols - 1), 0.5 * (grey.rows - 1));
  std::stable_sort(spots.begin(), spots.end(), [&](const Spot& a, const Spot& b) {
    return (a.at_px - middle).squaredNorm() < (b.at_px - middle).squaredNorm();
  });
  return spots;
}

NearbySpots::NearbySpots(const std::vector<Spot>& spots, double cell_px) : spots_(spots), cell_px_(cell_px) {
  for (const Spot& spot : spots) {
    columns_ = std::max(columns_, int(spot.at_px.x() / cell_px) + 1);
    rows_ = std::max(rows_, int(spot.at_px.y() / cell_px) + 1);
  }
  cells_.resize(std::size_t(columns_) * std::size_t(rows_));
  for (std::size_t i = 0; i < spots.size(); ++i) {
    const auto [column, row] = cell_of(spots[i].at_px);
    cells_[std::size_t(row * columns_ + column)].push_back(int(i));
  }
}

std::pair<int, int> NearbySpots::cell_of(const Eigen::Vector2d& place) const {
  return {std::clamp(int(std::floor(place.x() / cell_px_)), 0, columns_ - 1),
          std::clamp(int(std::floor(place.y() / cell_px_)), 0, rows_ - 1)};
}

std::vector<int> NearbySpots::within(const Eigen::Vector2d& place, double reach_px) const {
  std::vector<std::pair<double, int>> found;
  if (cells_.empty()) return {};
  const auto [left, top] = cell_of(place - Eigen::Vector2d::Constant(reach_px));
  const auto [right, bottom] = cell_of(place + Eigen::Vector2d::Constant(reach_px));
  for (int row = top; row <= bottom; ++row)
    for (int column = left; column <= right; ++column)
      for (const int i : cells_[std::size_t(row * columns_ + column)])
        if (const double distance = (spots_[std::size_t(i)].at_px - place).norm(); distance <= reach_px)
          found.emplace_back(distance, i);
  std::sort(found.begin(), found.end());
  std::vector<int> indices;
  for (const auto& [distance, i] : found) indices.push_back(i);
  return indices;
}

int NearbySpots::nearest(const Eigen::Vector2d& place, double reach_px) const {
  const std::vector<int> found = within(place, reach_px);
  return found.empty() ? -1 : found.front();
}

}  // namespace marrow::distortion
