// SPDX-License-Identifier: Apache-2.0
#include "marrow/similarity/patches.hpp"

namespace {

using marrow::match::Patch;
using marrow::match::PatchOptions;

marrow::match::SumMeasure measure_of(const Patch&, const PatchOptions& options) {
  return marrow::match::correlation_in_squares(options.patch_pixels, [](const Patch& patch) {
    marrow::match::Gradients g = marrow::match::gradients_of(patch);
    return std::vector<Patch>{std::move(g.u), std::move(g.v)};
  });
}

constexpr auto patch_gradient_correlation = marrow::match::intensity_node<measure_of, PatchOptions>;

}  // namespace

MARROW_PLUGIN(plugin) {
  auto node = plugin.node("similarity.patch_gradient_correlation", patch_gradient_correlation);
  node.summary(
          "1 - mean correlation of the gradients within small squares, weighted by the variance of the radiograph's "
          "gradients (Grupp et al., IEEE Trans Biomed Eng 2020)")
      .trait("unmoved_by_gain")
      .trait("derivatives");
  marrow::match::declare_patches(node);
}
