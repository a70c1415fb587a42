// SPDX-License-Identifier: Apache-2.0
#include "marrow/similarity/patches.hpp"

#include <opencv2/core/types.hpp>

namespace marrow::match {
namespace {

/// Of the pixels of a rectangle that count.
void add_pixels(const Patch& patch, const cv::Rect& cell, Moments& moments) {
  for (int row = cell.y; row < cell.y + cell.height; ++row)
    for (std::size_t i = patch.at(cell.x, row); i < patch.at(cell.x, row) + std::size_t(cell.width); ++i) {
      if (!patch.counts[i]) continue;  // its value may be NaN
      moments.add(patch.rendered[i], patch.seen[i]);
    }
}
void add_pixels(const Patch& patch, const cv::Rect& cell, JointMoments& moments) {
  for (int row = cell.y; row < cell.y + cell.height; ++row)
    for (std::size_t i = patch.at(cell.x, row); i < patch.at(cell.x, row) + std::size_t(cell.width); ++i) {
      if (!patch.counts[i]) continue;
      moments.add_pixel(patch.slopes_at(i), patch.rendered[i], patch.seen[i]);
    }
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

/// Calls use(column, row, moments) for each square, with the position of its middle.
template <class AnyMoments, class Use>
void each_square(const Patch& patch, int side, const Use& use) {
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
  std::vector<AnyMoments> of_cells(std::size_t(cell_columns) * std::size_t(cell_rows));
  for (int y = 0; y < cell_rows; ++y)
    for (int x = 0; x < cell_columns; ++x)
      add_pixels(patch, {left + border(x), top + border(y), border(x + 1) - border(x), border(y + 1) - border(y)},
                 of_cells[std::size_t(y * cell_columns + x)]);
  for (int row = 0; row < rows; ++row)
    for (int column = 0; column < columns; ++column) {
      AnyMoments moments;
      for (int y = row * per_step; y < row * per_step + cells; ++y)
        for (int x = column * per_step; x < column * per_step + cells; ++x)
          moments += of_cells[std::size_t(y * cell_columns + x)];
      use(left + column * step + 0.5 * side, top + row * step + 0.5 * side, moments);
    }
}

}  // namespace

SumMeasure correlation_in_squares(int side, std::function<std::vector<Patch>(const Patch&)> compared) {
  SumMeasure measure;
  measure.add = [side, compared](const Patch& patch, Tally& tally) {
    for (const Patch& one : compared(patch))
      each_square<Moments>(one, side, [&](double column, double row, const Moments& moments) {
        const Correlation square = correlation_of(moments);
        tally.add(column, row, square.weight * square.value, square.weight);
      });
  };
  measure.add_expansion = [side, compared](const Patch& patch, TallyOfExpansions& tally) {
    for (const Patch& one : compared(patch))
      each_square<JointMoments>(one, side, [&](double column, double row, const JointMoments& moments) {
        if (!moments.shows_bone) return;
        const CorrelationExpansion square = correlation_expansion(moments);
        tally.add(column, row,
                  SumsExpansion{{square.spread * square.value, square.spread},
                                square.spread * square.by_value + square.value * square.by_spread,
                                square.by_spread,
                                square.spread * square.curvature});
      });
  };
  return measure;
}

}  // namespace marrow::match
