// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/match/patches.hpp"

#include <algorithm>
#include <cmath>

namespace marrow::match {
namespace {

struct Correlation {
  double weight = 0, value = 0;
};

Correlation correlation_in(const Patch& patch, const std::vector<float>& a, const std::vector<float>& b,
                           const std::vector<char>& counts, int left, int top, int side) {
  constexpr double kLeastPixels = 16;
  double n = 0, sa = 0, sb = 0, aa = 0, bb = 0, ab = 0;
  for (int row = top; row < top + side; ++row)
    for (std::size_t i = patch.at(left, row); i < patch.at(left, row) + std::size_t(side); ++i) {
      if (!counts[i]) continue;  // its value may be NaN
      const double x = a[i], y = b[i];
      n += 1, sa += x, sb += y, aa += x * x, bb += y * y, ab += x * y;
    }
  if (n < kLeastPixels) return {};
  const double va = aa - sa * sa / n, vb = bb - sb * sb / n, cov = ab - sa * sb / n;
  if (!(va > 1e-9 + 1e-12 * aa)) return {};
  return {va, vb > 1e-14 + 1e-12 * bb ? std::clamp(cov / std::sqrt(va * vb), -1.0, 1.0) : 0};
}

}  // namespace

void add_patch_correlations(const Patch& patch, const std::vector<float>& a, const std::vector<float>& b,
                            const std::vector<char>& counts, int side, Tally& tally) {
  const int step = std::max(1, side / 2);
  // The squares have fixed positions in the image. If they moved along with the compared region, each pixel of its
  // motion would change all squares, and the cost would be rough.
  const auto first = [step](int origin) { return (step - origin % step) % step; };
  for (int top = first(patch.top); top + side <= patch.rows; top += step)
    for (int left = first(patch.left); left + side <= patch.columns; left += step) {
      const Correlation one = correlation_in(patch, a, b, counts, left, top, side);
      tally.add(left + 0.5 * side, top + 0.5 * side, one.weight * one.value, one.weight);
    }
}

double value_of_patch_correlations(const BlockSums::Sums& sums) {
  return sums.weights > 0 ? 1 - sums.values / sums.weights : 2;
}

}  // namespace marrow::match
