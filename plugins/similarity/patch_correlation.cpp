// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/match/patches.hpp"

namespace {

using marrow::match::Patch;
using marrow::match::PatchOptions;

std::shared_ptr<const marrow::Cost> patch_correlation(const marrow::Projector& projector,
                                                      const marrow::List<marrow::View>& views,
                                                      const marrow::List<marrow::Pose>* others,
                                                      const marrow::List<marrow::Projector>* other_projectors,
                                                      const PatchOptions& options) {
  return marrow::match::intensity_cost(
      projector, views, others, other_projectors, options, 2, [side = options.patch_pixels](const Patch& patch) {
        return 1 - marrow::match::mean_patch_correlation(patch, patch.rendered, patch.seen, patch.counts, side);
      });
}

}  // namespace

MARROW_PLUGIN(plugin) {
  auto node = plugin.node("similarity.patch_correlation", patch_correlation);
  node.summary(
      "1 - correlation of grey values within small squares, weighted by the radiograph's variance (LaRose 2001; Knaan "
      "and Joskowicz, MICCAI 2003)");
  marrow::match::declare_patches(node);
}
