// SPDX-License-Identifier: Apache-2.0
#include "marrow/similarity/patches.hpp"

namespace {

using marrow::match::Patch;
using marrow::match::PatchOptions;
using marrow::match::Tally;

marrow::match::SumMeasure measure_of(const Patch&, const PatchOptions& options) {
  const auto add = [side = options.patch_pixels](const Patch& patch, Tally& tally) {
    const marrow::match::Gradients g = marrow::match::gradients_of(patch);
    marrow::match::add_patch_correlations(patch, g.rendered_u, g.seen_u, g.counts, side, tally);
    marrow::match::add_patch_correlations(patch, g.rendered_v, g.seen_v, g.counts, side, tally);
  };
  return {add, marrow::match::value_of_patch_correlations};
}

constexpr auto patch_gradient_correlation = marrow::match::intensity_node<measure_of, PatchOptions>;

}  // namespace

MARROW_PLUGIN(plugin) {
  auto node = plugin.node("similarity.patch_gradient_correlation", patch_gradient_correlation);
  node.summary(
          "1 - mean correlation of the gradients within small squares, weighted by the variance of the radiograph's "
          "gradients (Grupp et al., IEEE Trans Biomed Eng 2020)")
      .trait("unmoved_by_gain");
  marrow::match::declare_patches(node);
}
