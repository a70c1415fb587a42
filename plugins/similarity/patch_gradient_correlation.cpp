// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <marrow/plugin.hpp>

#include "intensity.hpp"

namespace {

using marrow::similarity::Patch;

struct Options : marrow::similarity::IntensityOptions {
  int patch_pixels = 13;
};

/// Sums over squares of `side` pixels, side by side, each the correlation of the gradients within, weighted by the variance of the
/// rendered ones: where the model has no gradient, the image's do not matter.
double mean_correlation(const Patch& patch, const std::vector<float>& a, const std::vector<float>& b, const std::vector<char>& counts, int side) {
  double sum = 0, weights = 0;
  const int step = std::max(1, side / 2);
  for (int top = 0; top + side <= patch.rows; top += step)
    for (int left = 0; left + side <= patch.columns; left += step) {
      double n = 0, sa = 0, sb = 0, aa = 0, bb = 0, ab = 0;
      for (int row = top; row < top + side; ++row)
        for (std::size_t i = patch.at(left, row); i < patch.at(left, row) + std::size_t(side); ++i) {
          const double c = counts[i], x = c * a[i], y = c * b[i];
          n += c, sa += x, sb += y, aa += x * x, bb += y * y, ab += x * y;
        }
      if (n < 16) continue;
      const double va = aa - sa * sa / n, vb = bb - sb * sb / n, cov = ab - sa * sb / n;
      if (!(va > 1e-9)) continue;
      weights += va;
      if (vb > 1e-14) sum += va * std::clamp(cov / std::sqrt(va * vb), -1.0, 1.0);
    }
  return weights > 0 ? sum / weights : -1;
}

std::shared_ptr<const marrow::Cost> patch_gradient_correlation(const marrow::Projector& projector, const marrow::List<marrow::View>& views, const Options& options) {
  return marrow::similarity::intensity_cost(projector, views, options, 2, [side = options.patch_pixels](const Patch& patch) {
    const marrow::similarity::Gradients g = marrow::similarity::gradients_of(patch);
    return 1 - 0.5 * (mean_correlation(patch, g.rendered_u, g.seen_u, g.counts, side) + mean_correlation(patch, g.rendered_v, g.seen_v, g.counts, side));
  });
}

}  // namespace

MARROW_PLUGIN(plugin) {
  auto node = plugin.node("similarity.patch_gradient_correlation", patch_gradient_correlation);
  node.summary("1 - correlation of gradients within small squares, weighted by the radiograph's (Grupp et al., IEEE Trans Biomed Eng 2020)");
  marrow::similarity::declare<decltype(node), Options>(node);
  node.option("patch_pixels", &Options::patch_pixels, "side of the squares, in pixels that are compared", marrow::at_least(5), marrow::at_most(201));
}
