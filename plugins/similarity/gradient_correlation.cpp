// SPDX-License-Identifier: Apache-2.0
#include "marrow/similarity/intensity.hpp"

namespace {

using marrow::match::Patch;

marrow::match::CorrelationMeasure measure_of(const Patch&) {
  return {[](const Patch& patch) {
    marrow::match::Gradients g = marrow::match::gradients_of(patch);
    return std::vector<Patch>{std::move(g.u), std::move(g.v)};
  }};
}

constexpr auto gradient_correlation = marrow::match::intensity_node<measure_of>;

}  // namespace

MARROW_PLUGIN(plugin) {
  auto node = plugin.node("similarity.gradient_correlation", gradient_correlation);
  node.summary(
          "1 - mean of the correlations of the horizontal and of the vertical gradients (Penney et al., IEEE Trans Med "
          "Imaging 1998)")
      .trait("unmoved_by_gain")
      .trait("derivatives");
  marrow::match::declare<marrow::match::IntensityOptions>(node);
}
