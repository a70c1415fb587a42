// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/match/patches.hpp"

namespace {

using marrow::match::mean_patch_correlation;
using marrow::match::Patch;
using marrow::match::PatchOptions;

double value(const Patch& patch, const PatchOptions& options) {
  const marrow::match::Gradients g = marrow::match::gradients_of(patch);
  return 1 - 0.5 * (mean_patch_correlation(patch, g.rendered_u, g.seen_u, g.counts, options.patch_pixels) +
                    mean_patch_correlation(patch, g.rendered_v, g.seen_v, g.counts, options.patch_pixels));
}

constexpr auto patch_gradient_correlation = marrow::match::intensity_node<value, PatchOptions>;

}  // namespace

MARROW_PLUGIN(plugin) {
  auto node = plugin.node("similarity.patch_gradient_correlation", patch_gradient_correlation);
  node.summary(
          "1 - mean correlation of the gradients within small squares, weighted by the variance of the radiograph's "
          "gradients (Grupp et al., IEEE Trans Biomed Eng 2020)")
      .trait("unmoved_by_gain");
  marrow::match::declare_patches(node);
}
