// SPDX-License-Identifier: Apache-2.0
#include <cmath>

#include "marrow/similarity/structure.hpp"

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

/// The same for pairs between which the radiograph changes, with the column and row of the first pixel.
template <class Of>
void each_rendered_pair(const Patch& patch, int radius, const Of& of) {
  const auto columns = std::size_t(patch.columns);
  each_pair(patch, radius, [&](std::size_t i, std::size_t j) {
    if (patch.rendered[i] != patch.rendered[j]) of(int(i % columns), int(i / columns), i, j);
  });
}

/// Remaining structure: the sum over all pairs in the image of 1 - s^2 / (s^2 + (D_i - D_j)^2), divided by the same sum
/// without the model. D = seen - scale * rendered, and s is the given fraction of the image's standard deviation.
/// Except for constants, this is the sum of Weese and of Penney over a fixed region, the image. A mean over the
/// surroundings of the model would be lowest where the image is flat.
marrow::match::SumMeasure measure_of(const Patch& whole, const Options& options) {
  const double deviation = marrow::match::deviation(whole.seen, whole.counts);
  const marrow::match::Structure structure{std::max(1e-14, std::pow(options.sigma * deviation, 2))};
  double all = 0;
  each_pair(whole, options.radius_pixels,
            [&](std::size_t i, std::size_t j) { all += structure(whole.seen[i] - whole.seen[j]); });
  marrow::match::SumMeasure measure;
  measure.whole = all;
  measure.add = [=, radius = options.radius_pixels](const Patch& patch, marrow::match::Tally& tally) {
    const double scale = marrow::match::scale_of(marrow::match::gradients_of(patch)).value;
    if (!(scale > 0)) return;
    each_rendered_pair(patch, radius, [&](int column, int row, std::size_t i, std::size_t j) {
      tally.add(column, row,
                structure.removed(patch.seen[i] - patch.seen[j], patch.rendered[i] - patch.rendered[j], scale), 0);
    });
  };
  measure.add_expansion = [=, radius = options.radius_pixels](const Patch& patch,
                                                              marrow::match::TallyOfExpansions& tally) {
    const marrow::match::Scale scale = marrow::match::scale_of(marrow::match::gradients_of(patch));
    if (!(scale.value > 0)) return;
    each_rendered_pair(patch, radius, [&](int column, int row, std::size_t i, std::size_t j) {
      tally.add(column, row,
                structure.removed(patch.seen[i] - patch.seen[j], patch.rendered[i] - patch.rendered[j],
                                  patch.slopes_at(i) - patch.slopes_at(j), scale));
    });
  };
  return measure;
}

constexpr auto pattern_intensity = marrow::match::intensity_node<measure_of, Options>;

}  // namespace

MARROW_PLUGIN(plugin) {
  auto node = plugin.node("similarity.pattern_intensity", pattern_intensity);
  node.summary(
          "Structure that remains after the radiograph is subtracted from the image (pattern intensity: Weese et al., "
          "IEEE Trans Inf Technol Biomed 1997; Penney et al. 1998)")
      .trait("unmoved_by_gain")
      .trait("derivatives");
  marrow::match::declare<Options>(node);
  node.option("radius_pixels", &Options::radius_pixels, "radius of the neighbourhood", marrow::at_least(1),
              marrow::at_most(20))
      .option("sigma", &Options::sigma, "smaller differences are not structure; in standard deviations of the image",
              marrow::at_least(1e-3), marrow::unit("1"));
}
