// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include "marrow/similarity/structure.hpp"

namespace {

using marrow::match::Patch;
using marrow::match::Structure;

/// Calls of(column, row, i) for each place where the radiograph has a gradient.
template <class Of>
void each_gradient(const marrow::match::Gradients& g, const Of& of) {
  for (int row = 0; row < g.u.rows; ++row)
    for (int column = 0; column < g.u.columns; ++column)
      if (const std::size_t i = g.u.at(column, row); g.u.counts[i] && (g.u.rendered[i] != 0 || g.v.rendered[i] != 0))
        of(column, row, i);
}

/// Remaining structure: the sums over the image, for both directions, of 1 - A / (A + d^2), divided by the same sums
/// without the model. d is the difference of the gradients, and A the variance of the image's gradients. Except for
/// constants, this is Penney's sum over a fixed region, the image.
marrow::match::SumMeasure measure_of(const Patch& whole) {
  Patch unseen = whole;
  unseen.rendered.assign(whole.seen.size(), 0.0f);
  const marrow::match::Gradients image = marrow::match::gradients_of(unseen);
  const auto structure = [&](const Patch& gradients) {
    return Structure{std::max(1e-14, std::pow(marrow::match::deviation(gradients.seen, gradients.counts), 2))};
  };
  const Structure of_u = structure(image.u), of_v = structure(image.v);
  double all = 0;
  for (std::size_t i = 0; i < image.u.counts.size(); ++i)
    if (image.u.counts[i]) all += of_u(image.u.seen[i]) + of_v(image.v.seen[i]);
  marrow::match::SumMeasure measure;
  measure.whole = all;
  measure.add = [=](const Patch& patch, marrow::match::Tally& tally) {
    const marrow::match::Gradients g = marrow::match::gradients_of(patch);
    const double scale = marrow::match::scale_of(g).value;
    if (!(scale > 0)) return;
    each_gradient(g, [&](int column, int row, std::size_t i) {
      tally.add(column, row,
                of_u.removed(g.u.seen[i], g.u.rendered[i], scale) + of_v.removed(g.v.seen[i], g.v.rendered[i], scale),
                0);
    });
  };
  measure.add_expansion = [=](const Patch& patch, marrow::match::TallyOfExpansions& tally) {
    const marrow::match::Gradients g = marrow::match::gradients_of(patch);
    const marrow::match::Scale scale = marrow::match::scale_of(g);
    if (!(scale.value > 0)) return;
    each_gradient(g, [&](int column, int row, std::size_t i) {
      auto removed = of_u.removed(g.u.seen[i], g.u.rendered[i], g.u.slopes_at(i), scale);
      tally.add(column, row, removed += of_v.removed(g.v.seen[i], g.v.rendered[i], g.v.slopes_at(i), scale));
    });
  };
  return measure;
}

constexpr auto gradient_difference = marrow::match::intensity_node<measure_of>;

}  // namespace

MARROW_PLUGIN(plugin) {
  auto node = plugin.node("similarity.gradient_difference", gradient_difference);
  node.summary(
          "Gradients that remain after the radiograph is subtracted from the image (gradient difference); thin bright "
          "lines hardly disturb this measure (Penney et al., IEEE Trans Med Imaging 1998)")
      .trait("unmoved_by_gain")
      .trait("derivatives");
  marrow::match::declare<marrow::match::IntensityOptions>(node);
}
