// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/match/patches.hpp"

namespace {

using marrow::match::mean_patch_correlation;
using marrow::match::Patch;
using marrow::match::PatchOptions;

std::shared_ptr<const marrow::Cost> patch_gradient_correlation(const marrow::Projector& projector,
                                                               const marrow::List<marrow::View>& views,
                                                               const marrow::List<marrow::Pose>* others,
                                                               const marrow::List<marrow::Projector>* other_projectors,
                                                               const PatchOptions& options) {
  return marrow::match::intensity_cost(
      projector, views, others, other_projectors, options, 2, [side = options.patch_pixels](const Patch& patch) {
        const marrow::match::Gradients g = marrow::match::gradients_of(patch);
        return 1 - 0.5 * (mean_patch_correlation(patch, g.rendered_u, g.seen_u, g.counts, side) +
                          mean_patch_correlation(patch, g.rendered_v, g.seen_v, g.counts, side));
      });
}

}  // namespace

MARROW_PLUGIN(plugin) {
  auto node = plugin.node("similarity.patch_gradient_correlation", patch_gradient_correlation);
  node.summary(
      "1 - correlation of gradients within small squares, weighted by the radiograph's (Grupp et al., IEEE Trans "
      "Biomed Eng 2020)");
  marrow::match::declare_patches(node);
}
