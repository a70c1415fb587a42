// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <marrow/plugin.hpp>

#include "marrow/similarity/intensity.hpp"

namespace {

using marrow::match::Patch;

struct Options : marrow::match::IntensityOptions {
  int radius_pixels = 3;
  double sigma = 0.5;
};

/// Calls of(i, j) once for each pair of pixels that count and lie within the radius; i and j are their indices in the
/// patch.
template <class Of>
void each_pair(const Patch& patch, int radius, const Of& of) {
  for (int row = 0; row < patch.rows; ++row)
    for (int down = 0; down <= std::min(radius, patch.rows - 1 - row); ++down)
      for (int right = down == 0 ? 1 : -radius; right <= radius; ++right) {
        if (right * right + down * down > radius * radius) continue;
        for (int column = std::max(0, -right); column < std::min(patch.columns, patch.columns - right); ++column) {
          const std::size_t i = patch.at(column, row), j = patch.at(column + right, row + down);
          if (patch.counts[i] && patch.counts[j]) of(i, j);
        }
      }
}

/// Remaining structure: the sum over all pairs in the image of 1 - s^2 / (s^2 + (D_i - D_j)^2), divided by the same sum
/// without the model. D = seen - scale * rendered, and s is the given fraction of the image's standard deviation.
/// Except for constants, this is the sum of Weese and of Penney over a fixed region, the image. A mean over the
/// surroundings of the model would be lowest where the image is flat.
marrow::match::SumMeasure measure_of(const Patch& whole, const Options& options) {
  const double deviation = marrow::match::deviation(whole.seen, whole.counts),
               s2 = std::max(1e-14, std::pow(options.sigma * deviation, 2));
  const auto structure = [s2](double d) { return d * d / (s2 + d * d); };
  double all = 0;
  each_pair(whole, options.radius_pixels,
            [&](std::size_t i, std::size_t j) { all += structure(whole.seen[i] - whole.seen[j]); });
  const auto add = [=, radius = options.radius_pixels](const Patch& patch, marrow::match::Tally& tally) {
    const float scale = float(marrow::match::scale_of(marrow::match::gradients_of(patch)));
    if (!(scale > 0)) return;
    each_pair(patch, radius, [&](std::size_t i, std::size_t j) {
      const float seen = patch.seen[i] - patch.seen[j], rendered = patch.rendered[i] - patch.rendered[j];
      if (rendered == 0) return;
      const auto columns = std::size_t(patch.columns);
      tally.add(double(i % columns), double(i / columns), structure(seen) - structure(seen - scale * rendered), 0);
    });
  };
  return {add, [all](const auto& sums) { return all > 0 ? std::min(2.0, 1 - sums.values / all) : 1; }};
}

constexpr auto pattern_intensity = marrow::match::intensity_node<measure_of, Options>;

}  // namespace

MARROW_PLUGIN(plugin) {
  auto node = plugin.node("similarity.pattern_intensity", pattern_intensity);
  node.summary(
          "Structure that remains after the radiograph is subtracted from the image (pattern intensity: Weese et al., "
          "IEEE Trans Inf Technol Biomed 1997; Penney et al. 1998)")
      .trait("unmoved_by_gain");
  marrow::match::declare<Options>(node);
  node.option("radius_pixels", &Options::radius_pixels, "radius of the neighbourhood", marrow::at_least(1),
              marrow::at_most(20))
      .option("sigma", &Options::sigma, "smaller differences are not structure; in standard deviations of the image",
              marrow::at_least(1e-3), marrow::unit("1"));
}
