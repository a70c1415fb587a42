// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <marrow/plugin.hpp>

#include "marrow/similarity/intensity.hpp"

namespace {

using marrow::match::Patch;

/// Remaining structure: the sums over the image, for both directions, of 1 - A / (A + d^2), divided by the same sums
/// without the model. d is the difference of the gradients, and A the variance of the image's gradients. Except for
/// constants, this is Penney's sum over a fixed region, the image.
marrow::match::SumMeasure measure_of(const Patch& whole) {
  Patch unseen = whole;
  unseen.rendered.assign(whole.seen.size(), 0.0f);
  const marrow::match::Gradients image = marrow::match::gradients_of(unseen);
  const auto variance = [&](const std::vector<float>& gradients) {
    return std::max(1e-14, std::pow(marrow::match::deviation(gradients, image.counts), 2));
  };
  const double u2 = variance(image.seen_u), v2 = variance(image.seen_v);
  const auto structure = [](double d, double variance) { return d * d / (variance + d * d); };
  double all = 0;
  for (std::size_t i = 0; i < image.counts.size(); ++i)
    if (image.counts[i]) all += structure(image.seen_u[i], u2) + structure(image.seen_v[i], v2);
  const auto add = [=](const Patch& patch, marrow::match::Tally& tally) {
    const marrow::match::Gradients g = marrow::match::gradients_of(patch);
    const double scale = marrow::match::scale_of(g);
    if (!(scale > 0)) return;
    for (int row = 0; row < patch.rows; ++row)
      for (int column = 0; column < patch.columns; ++column) {
        const std::size_t i = patch.at(column, row);
        if (!g.counts[i] || (g.rendered_u[i] == 0 && g.rendered_v[i] == 0)) continue;
        const double less = structure(g.seen_u[i], u2) - structure(g.seen_u[i] - scale * g.rendered_u[i], u2) +
                            (structure(g.seen_v[i], v2) - structure(g.seen_v[i] - scale * g.rendered_v[i], v2));
        tally.add(column, row, less, 0);
      }
  };
  return {add, [all](const auto& sums) { return all > 0 ? std::min(2.0, 1 - sums.values / all) : 1; }};
}

constexpr auto gradient_difference = marrow::match::intensity_node<measure_of>;

}  // namespace

MARROW_PLUGIN(plugin) {
  auto node = plugin.node("similarity.gradient_difference", gradient_difference);
  node.summary(
          "Gradients that remain after the radiograph is subtracted from the image (gradient difference); thin bright "
          "lines hardly disturb this measure (Penney et al., IEEE Trans Med Imaging 1998)")
      .trait("unmoved_by_gain");
  marrow::match::declare<marrow::match::IntensityOptions>(node);
}
