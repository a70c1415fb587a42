// SPDX-License-Identifier: Apache-2.0
#include "marrow/similarity/patches.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/core/types.hpp>

#include "moments.hpp"

namespace marrow::match {
namespace {

/// Of the pixels of a square that count.
Moments moments_in(const Patch& patch, const std::vector<float>& a, const std::vector<float>& b,
                   const std::vector<char>& counts, const cv::Rect& cell) {
  Moments moments;
  for (int row = cell.y; row < cell.y + cell.height; ++row)
    for (std::size_t i = patch.at(cell.x, row); i < patch.at(cell.x, row) + std::size_t(cell.width); ++i) {
      if (!counts[i]) continue;  // its value may be NaN
      moments.add(a[i], b[i]);
    }
  return moments;
}

struct Correlation {
  double weight = 0, value = 0;
};

Correlation correlation_of(const Moments& m) {
  constexpr double kLeastPixels = 16;
  if (m.n < kLeastPixels) return {};
  const double va = m.spread_a(), vb = m.spread_b();
  if (!(va > 1e-9 + 1e-12 * m.aa)) return {};
  return {va, vb > 1e-14 + 1e-12 * m.bb ? std::clamp(m.spread_ab() / std::sqrt(va * vb), -1.0, 1.0) : 0};
}

}  // namespace

void add_patch_correlations(const Patch& patch, const std::vector<float>& a, const std::vector<float>& b,
                            const std::vector<char>& counts, int side, Tally& tally) {
  const int step = std::max(1, side / 2);
  // The squares have fixed positions in the image. If they moved along with the compared region, each pixel of its
  // motion would change all squares, and the cost would be rough.
  const auto first = [step](int origin) { return (step - origin % step) % step; };
  const int left = first(patch.left), top = first(patch.top);
  const int columns = std::max(0, (patch.columns - left - side + step) / step),
            rows = std::max(0, (patch.rows - top - side + step) / step);
  if (columns == 0 || rows == 0) return;
  // Squares overlap by about half. So the image is cut at all their borders, and each square is a sum of these cells.
  const int rest = side % step, per_step = rest > 0 ? 2 : 1, cells = side / step * per_step + (rest > 0 ? 1 : 0);
  const auto border = [&](int i) { return i / per_step * step + i % per_step * rest; };
  const int cell_columns = (columns - 1) * per_step + cells, cell_rows = (rows - 1) * per_step + cells;
  std::vector<Moments> of_cells;
  for (int y = 0; y < cell_rows; ++y)
    for (int x = 0; x < cell_columns; ++x)
      of_cells.push_back(
          moments_in(patch, a, b, counts,
                     {left + border(x), top + border(y), border(x + 1) - border(x), border(y + 1) - border(y)}));
  for (int row = 0; row < rows; ++row)
    for (int column = 0; column < columns; ++column) {
      Moments moments;
      for (int y = row * per_step; y < row * per_step + cells; ++y)
        for (int x = column * per_step; x < column * per_step + cells; ++x)
          moments += of_cells[std::size_t(y * cell_columns + x)];
      const Correlation one = correlation_of(moments);
      tally.add(left + column * step + 0.5 * side, top + row * step + 0.5 * side, one.weight * one.value, one.weight);
    }
}

double value_of_patch_correlations(const BlockSums::Sums& sums) {
  return sums.weights > 0 ? 1 - sums.values / sums.weights : 2;
}

}  // namespace marrow::match
