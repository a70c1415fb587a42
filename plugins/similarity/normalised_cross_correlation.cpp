// SPDX-License-Identifier: Apache-2.0
#include "marrow/similarity/intensity.hpp"

namespace {

using marrow::match::Patch;

marrow::match::CorrelationMeasure measure_of(const Patch&) {
  return {[](const Patch& patch) { return std::vector<Patch>{patch}; }};
}

constexpr auto normalised_cross_correlation = marrow::match::intensity_node<measure_of>;

}  // namespace

MARROW_PLUGIN(plugin) {
  auto node = plugin.node("similarity.normalised_cross_correlation", normalised_cross_correlation);
  node.summary("1 - normalised cross-correlation of radiograph and image (Penney et al., IEEE Trans Med Imaging 1998)")
      .trait("unmoved_by_gain")
      .trait("derivatives");
  marrow::match::declare<marrow::match::IntensityOptions>(node);
}
