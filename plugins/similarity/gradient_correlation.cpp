// SPDX-License-Identifier: Apache-2.0
#include <marrow/plugin.hpp>

#include "marrow/similarity/intensity.hpp"

namespace {

using marrow::match::Patch;

double value(const Patch& patch) {
  const marrow::match::Gradients g = marrow::match::gradients_of(patch);
  using marrow::match::correlation;
  return 1 - 0.5 * (correlation(g.rendered_u, g.seen_u, g.counts) + correlation(g.rendered_v, g.seen_v, g.counts));
}

constexpr auto gradient_correlation = marrow::match::intensity_node<value>;

}  // namespace

MARROW_PLUGIN(plugin) {
  auto node = plugin.node("similarity.gradient_correlation", gradient_correlation);
  node.summary(
          "1 - mean of the correlations of the horizontal and of the vertical gradients (Penney et al., IEEE Trans Med "
          "Imaging 1998)")
      .trait("unmoved_by_gain");
  marrow::match::declare<marrow::match::IntensityOptions>(node);
}
