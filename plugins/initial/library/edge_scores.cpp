// SPDX-License-Identifier: Apache-2.0
#include "marrow/initial/edge_scores.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

namespace marrow::initial {
namespace {

/// The cells of edges whose gradient is within 35 degrees of a direction are 0, all others 255.
cv::Mat cells_without(const EdgeMap& edges, const cv::Mat& usable, double cell_px, double direction_rad) {
  constexpr double kLeastCosine = 0.82;
  cv::Mat cells(usable.size(), CV_8U, cv::Scalar(255));
  const double cu = std::cos(direction_rad), cv = std::sin(direction_rad);
  for (const EdgePixel& edge : edges.pixels) {
    if (edge.direction_u * cu + edge.direction_v * cv < kLeastCosine) continue;
    const int column = int(edge.u_px / cell_px), row = int(edge.v_px / cell_px);
    if (column < 0 || row < 0 || column >= cells.cols || row >= cells.rows) continue;
    if (usable.at<std::uint8_t>(row, column)) cells.at<std::uint8_t>(row, column) = 0;
  }
  return cells;
}

}  // namespace

int EdgeScores::sector_of(double normal_u, double normal_v) {
  const double turns = std::atan2(normal_v, normal_u) / (2 * kPi);
  return int(std::lround(turns * kSectors) + kSectors) % kSectors;
}

EdgeScores::EdgeScores(const View& view, const EdgeMap& edges, double cell_px)
    : columns_(int(std::ceil(view.camera.width_px / cell_px))),
      rows_(int(std::ceil(view.camera.height_px / cell_px))),
      cell_px_(cell_px) {
  constexpr double kMatchedOfBone = 0.95, kReach_cells = 7;
  cv::Mat usable(rows_, columns_, CV_8U, cv::Scalar(255));
  if (!view.mask.empty()) cv::resize(view.mask, usable, usable.size(), 0, 0, cv::INTER_NEAREST);
  std::vector<cv::Mat> matched(kSectors);  // 1 at an edge, 0 from the reach on
  double sum = 0;
  for (int sector = 0; sector < kSectors; ++sector) {
    cv::Mat distance;
    cv::distanceTransform(cells_without(edges, usable, cell_px, 2 * kPi * sector / kSectors), distance, cv::DIST_L2,
                          cv::DIST_MASK_PRECISE);
    matched[std::size_t(sector)] = cv::max(1 - distance / kReach_cells, 0);
    sum += cv::mean(matched[std::size_t(sector)], usable)[0] / kSectors;
  }
  const double by_chance = std::clamp(sum, 0.05, 0.6);
  const double of_hit = std::log(kMatchedOfBone / by_chance),
               of_miss = std::log((1 - kMatchedOfBone) / (1 - by_chance)),
               unit = kMost / std::log(kMatchedOfBone / 0.05);
  scores_.assign(std::size_t(kSectors) * std::size_t(columns_) * std::size_t(rows_), 0);
  auto score = scores_.begin();
  for (const cv::Mat& of_sector : matched)
    for (int row = 0; row < rows_; ++row)
      for (int column = 0; column < columns_; ++column, ++score)
        if (usable.at<std::uint8_t>(row, column))
          *score = std::int8_t(
              std::lround(unit * (of_miss + double(of_sector.at<float>(row, column)) * (of_hit - of_miss))));
}

}  // namespace marrow::initial
