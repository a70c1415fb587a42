// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <marrow/domain/features.hpp>
#include <marrow/domain/functions.hpp>
#include <opencv2/core.hpp>
#include <vector>

namespace marrow::match {

/// For any pixel and direction, the nearest edge whose gradient has about this direction. Directions are divided into
/// 16 sectors. For each sector a label image names the nearest edge of each cell of 2 x 2 pixels (by an exact distance
/// transform: Felzenszwalb and Huttenlocher, Theory of Computing 2012).
class NearestEdges {
 public:
  /// Uses the edges inside the mask (CV_8U; empty: all). An edge belongs to all sectors whose middle differs from its
  /// direction by at most `tolerance_rad`.
  NearestEdges(const EdgeMap& edges, const cv::Mat& mask, double tolerance_rad)
      : columns_((edges.width_px + kCell_px - 1) / kCell_px), rows_((edges.height_px + kCell_px - 1) / kCell_px) {
    for (const EdgePixel& edge : edges.pixels) {
      const int u = int(std::lround(edge.u_px)), v = int(std::lround(edge.v_px));
      if (u < 0 || v < 0 || u >= edges.width_px || v >= edges.height_px) continue;
      if (mask.empty() || mask.at<std::uint8_t>(v, u)) edges_.push_back(edge);
    }
    smooth(edges.width_px, edges.height_px);
    rows_of_edges_.reserve(edges_.size());
    for (const EdgePixel& edge : edges_) rows_of_edges_.push_back(row_of(edge));
    labels_.resize(kSectors * std::size_t(rows_) * std::size_t(columns_));
    tbb::parallel_for(0, kSectors, [&](int sector) { fill(sector, tolerance_rad); });
  }

  bool empty() const { return edges_.empty(); }
  /// The edges that are used, at their smoothed positions.
  const std::vector<EdgePixel>& all() const { return edges_; }

  /// The nearest edge, or nullptr if there is none with this direction. The pixel must lie inside the image.
  const EdgePixel* find(float u, float v, float direction_u, float direction_v) const {
    const int column = int(u + 0.5f) / kCell_px, row = int(v + 0.5f) / kCell_px;
    const std::int32_t label =
        labels_[(std::size_t(sector_of(direction_u, direction_v)) * std::size_t(rows_) + std::size_t(row)) *
                    std::size_t(columns_) +
                std::size_t(column)];
    return label < 0 ? nullptr : &edges_[std::size_t(label)];
  }

 private:
  static constexpr int kCell_px = 2;
  static constexpr int kSectors = 16;

  /// Sector of a direction. A position on the diamond |u| + |v| = 1 is faster to compute than an angle.
  static int sector_of(float u, float v) {
    const float along = u / (std::abs(u) + std::abs(v) + 1e-30f);
    const float around = v >= 0 ? 1 - along : 3 + along;  // 0 to 4, rising with the angle
    return std::min(int(around * (kSectors / 4)), kSectors - 1);
  }
  static double middle_of(int sector) {
    const double around = (sector + 0.5) * 4 / kSectors;
    const double along = around < 2 ? 1 - around : around - 3;
    return std::atan2((1 - std::abs(along)) * (around < 2 ? 1 : -1), along);
  }

  /// Moves each edge along its direction to the mean of its neighbours on the same border. A cell keeps only one edge,
  /// and a single edge pixel is noisier than a mean of several.
  void smooth(int width, int height) {
    constexpr int kReach_px = 3;
    constexpr float kSameBorder_px = 1.2f, kSameDirection = 0.8f;
    cv::Mat at(height, width, CV_32S, cv::Scalar(-1));
    for (std::size_t i = 0; i < edges_.size(); ++i)
      at.at<int>(int(std::lround(edges_[i].v_px)), int(std::lround(edges_[i].u_px))) = int(i);
    std::vector<float> shift(edges_.size());
    for (std::size_t i = 0; i < edges_.size(); ++i) {
      const EdgePixel& edge = edges_[i];
      const int u = int(std::lround(edge.u_px)), v = int(std::lround(edge.v_px));
      float sum = 0, count = 0;
      for (int y = std::max(0, v - kReach_px); y <= std::min(height - 1, v + kReach_px); ++y)
        for (int x = std::max(0, u - kReach_px); x <= std::min(width - 1, u + kReach_px); ++x) {
          const int j = at.at<int>(y, x);
          if (j < 0) continue;
          const EdgePixel& other = edges_[std::size_t(j)];
          const float offset =
              (other.u_px - edge.u_px) * edge.direction_u + (other.v_px - edge.v_px) * edge.direction_v;
          const float cosine = other.direction_u * edge.direction_u + other.direction_v * edge.direction_v;
          if (std::abs(offset) > kSameBorder_px || cosine < kSameDirection) continue;
          sum += offset;
          count += 1;
        }
      shift[i] = count > 0 ? sum / count : 0;
    }
    for (std::size_t i = 0; i < edges_.size(); ++i) {
      edges_[i].u_px += shift[i] * edges_[i].direction_u;
      edges_[i].v_px += shift[i] * edges_[i].direction_v;
    }
  }

  void fill(int sector, double tolerance_rad) {
    std::int32_t* labels = labels_.data() + std::size_t(sector) * std::size_t(rows_) * std::size_t(columns_);
    std::fill(labels, labels + std::size_t(rows_) * std::size_t(columns_), -1);
    const double middle = middle_of(sector);
    const float cu = float(std::cos(middle)), cv = float(std::sin(middle)), least = float(std::cos(tolerance_rad));
    for (std::size_t i = 0; i < edges_.size(); ++i) {
      const EdgePixel& edge = edges_[i];
      if (edge.direction_u * cu + edge.direction_v * cv < least) continue;
      std::int32_t& label = labels[row_of(edge) * columns_ + column_of(edge)];
      if (label < 0 || edges_[std::size_t(label)].magnitude < edge.magnitude) label = std::int32_t(i);
    }
    nearest_in_columns(labels);
    for (int row = 0; row < rows_; ++row) nearest_in_row(labels + std::size_t(row) * std::size_t(columns_), row);
  }

  // The cell of an edge. If smoothing has moved the edge out of the image, it is the cell at the border.
  int column_of(const EdgePixel& edge) const { return std::clamp(int(edge.u_px + 0.5f) / kCell_px, 0, columns_ - 1); }
  int row_of(const EdgePixel& edge) const { return std::clamp(int(edge.v_px + 0.5f) / kCell_px, 0, rows_ - 1); }
  int row_of(std::int32_t label) const { return rows_of_edges_[std::size_t(label)]; }

  /// Each cell gets the nearest edge of its own column.
  void nearest_in_columns(std::int32_t* labels) const {
    std::vector<std::int32_t> below(std::size_t(rows_) * std::size_t(columns_), -1);
    for (int row = rows_ - 1; row >= 0; --row)
      for (int column = 0; column < columns_; ++column) {
        const std::size_t cell = std::size_t(row) * std::size_t(columns_) + std::size_t(column);
        below[cell] = labels[cell] >= 0 || row == rows_ - 1 ? labels[cell] : below[cell + std::size_t(columns_)];
      }
    std::vector<std::int32_t> above(std::size_t(columns_), -1);
    for (int row = 0; row < rows_; ++row)
      for (int column = 0; column < columns_; ++column) {
        const std::size_t cell = std::size_t(row) * std::size_t(columns_) + std::size_t(column);
        std::int32_t& last = above[std::size_t(column)];
        if (labels[cell] >= 0)
          last = labels[cell];
        else if (last < 0 || (below[cell] >= 0 && row_of(below[cell]) - row < row - row_of(last)))
          labels[cell] = below[cell];
        else
          labels[cell] = last;
      }
  }

  /// Lower envelope of the parabolas (column - q)^2 + (distance within column q)^2.
  void nearest_in_row(std::int32_t* labels, int row) const {
    struct Parabola {
      int centre;
      float height, from;
      std::int32_t label;
    };
    constexpr float kInfinity = std::numeric_limits<float>::infinity();
    std::vector<Parabola> envelope;
    envelope.reserve(std::size_t(columns_));
    for (int q = 0; q < columns_; ++q) {
      if (labels[q] < 0) continue;
      const float distance = float(row_of(labels[q]) - row), h = distance * distance + float(q) * float(q);
      float start = -kInfinity;
      while (!envelope.empty()) {
        start = (h - envelope.back().height) / float(2 * (q - envelope.back().centre));
        if (start > envelope.back().from) break;
        envelope.pop_back();
        start = -kInfinity;
      }
      envelope.push_back({q, h, start, labels[q]});
    }
    if (envelope.empty()) return;
    // Each parabola is the lowest from its own `from` to that of the next; a column on the limit belongs to the first.
    int first = 0;
    for (std::size_t k = 0; k < envelope.size(); ++k) {
      int end = columns_;
      if (k + 1 < envelope.size()) end = std::min(columns_, int(std::floor(envelope[k + 1].from)) + 1);
      for (; first < end; ++first) labels[first] = envelope[k].label;
    }
  }

  int columns_, rows_;
  std::vector<EdgePixel> edges_;
  std::vector<int> rows_of_edges_;  ///< a small table, because the rows of a million cells are asked for
  std::vector<std::int32_t> labels_;
};

/// For any edge pixel, the nearest outline point with about the same direction, up to a distance. Points are sorted
/// into square cells of this width.
class NearestOutline {
 public:
  /// `reach_px`: the largest distance for find(). `points` must outlive this object.
  NearestOutline(const std::vector<OutlinePoint>& points, int width_px, int height_px, double reach_px)
      : points_(points),
        cell_px_(float(std::max(reach_px, 1.0))),
        columns_(int(float(width_px) / cell_px_) + 1),
        rows_(int(float(height_px) / cell_px_) + 1) {
    first_.assign(std::size_t(columns_) * std::size_t(rows_) + 1, 0);
    std::vector<std::size_t> cells;
    for (const OutlinePoint& p : points_) cells.push_back(cell(column(p.u_px), row(p.v_px)));
    for (const std::size_t c : cells) ++first_[c + 1];
    for (std::size_t i = 1; i < first_.size(); ++i) first_[i] += first_[i - 1];
    order_.resize(points_.size());
    std::vector<std::uint32_t> next(first_.begin(), first_.end() - 1);
    for (std::size_t i = 0; i < cells.size(); ++i) order_[next[cells[i]]++] = std::uint32_t(i);
  }

  /// Index of the nearest point, or -1 if there is none within `reach_px`, which must not exceed that of the
  /// constructor. `least_cosine`: of the angle between the edge's direction and the point's normal. With
  /// `either_polarity`, the direction may also be the opposite one.
  int find(const EdgePixel& edge, double reach_px, float least_cosine, bool either_polarity = false) const {
    int nearest = -1;
    float least = float(reach_px * reach_px);
    const int c = column(edge.u_px), r = row(edge.v_px);
    for (int y = std::max(0, r - 1); y <= std::min(rows_ - 1, r + 1); ++y)
      for (int x = std::max(0, c - 1); x <= std::min(columns_ - 1, c + 1); ++x)
        for (std::uint32_t k = first_[cell(x, y)]; k < first_[cell(x, y) + 1]; ++k) {
          const OutlinePoint& p = points_[order_[k]];
          const float du = edge.u_px - p.u_px, dv = edge.v_px - p.v_px, distance2 = du * du + dv * dv;
          const float cosine = edge.direction_u * p.normal_u + edge.direction_v * p.normal_v;
          if (distance2 >= least || (either_polarity ? std::abs(cosine) : cosine) < least_cosine) continue;
          least = distance2;
          nearest = int(order_[k]);
        }
    return nearest;
  }

 private:
  int column(float u) const { return std::clamp(int(u / cell_px_), 0, columns_ - 1); }
  int row(float v) const { return std::clamp(int(v / cell_px_), 0, rows_ - 1); }
  std::size_t cell(int column, int row) const { return std::size_t(row) * std::size_t(columns_) + std::size_t(column); }

  const std::vector<OutlinePoint>& points_;
  const float cell_px_;
  const int columns_, rows_;
  std::vector<std::uint32_t> first_, order_;
};

}  // namespace marrow::match
