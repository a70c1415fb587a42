// SPDX-License-Identifier: Apache-2.0
#include <marrow/plugin.hpp>

#include "intensity.hpp"

namespace {

using marrow::similarity::Patch;

struct Options : marrow::similarity::IntensityOptions {
  int radius_pixels = 3;
  double sigma = 0.5;
};

/// Mean over pixels and their neighbours within the radius of s^2 / (s^2 + (D_i - D_j)^2), D = seen - scale * rendered and s the given
/// part of the deviation of the image: where the model is right, it leaves no structure in D.
double value(const Patch& patch, const Options& options) {
  const marrow::similarity::Fit fit = marrow::similarity::fit_of(patch);
  if (!(fit.scale > 0)) return 1;
  std::vector<float> difference(patch.seen.size());
  double n = 0, sum = 0, squares = 0;
  for (std::size_t i = 0; i < difference.size(); ++i) {
    difference[i] = patch.seen[i] - float(fit.scale) * patch.rendered[i];
    if (!patch.counts[i]) continue;
    n += 1, sum += patch.seen[i], squares += double(patch.seen[i]) * patch.seen[i];
  }
  const double variance = options.sigma * options.sigma * (squares / n - sum * sum / (n * n));
  if (!(variance > 1e-14)) return 1;
  const int r = options.radius_pixels;
  double total = 0, pairs = 0;
  // Each pair once: the neighbours behind a pixel in reading order.
  for (int row = 0; row < patch.rows; ++row)
    for (int down = 0; down <= std::min(r, patch.rows - 1 - row); ++down)
      for (int right = down == 0 ? 1 : -r; right <= r; ++right) {
        if (right * right + down * down > r * r) continue;
        for (int column = std::max(0, -right); column < std::min(patch.columns, patch.columns - right); ++column) {
          const std::size_t i = patch.at(column, row), j = patch.at(column + right, row + down);
          if (!patch.counts[i] || !patch.counts[j]) continue;
          const double d = difference[i] - difference[j];
          total += variance / (variance + d * d);
          pairs += 1;
        }
      }
  return pairs > 0 ? 1 - total / pairs : 1;
}

std::shared_ptr<const marrow::Cost> pattern_intensity(const marrow::Projector& projector, const marrow::List<marrow::View>& views, const marrow::List<marrow::Pose>* others,
    const marrow::List<marrow::Projector>* other_projectors, const Options& options) {
  return marrow::similarity::intensity_cost(projector, views, others, other_projectors, options, 1, [options](const Patch& patch) { return value(patch, options); });
}

}  // namespace

MARROW_PLUGIN(plugin) {
  auto node = plugin.node("similarity.pattern_intensity", pattern_intensity);
  node.summary("1 - pattern intensity of the difference image (Weese et al., IEEE Trans Inf Technol Biomed 1997; Penney et al. 1998)");
  marrow::similarity::declare<decltype(node), Options>(node);
  node.option("radius_pixels", &Options::radius_pixels, "of the neighbourhood", marrow::at_least(1), marrow::at_most(20))
      .option("sigma", &Options::sigma, "differences below it are no structure, in deviations of the image", marrow::at_least(1e-3), marrow::unit("1"));
}
