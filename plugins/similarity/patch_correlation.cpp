// SPDX-License-Identifier: Apache-2.0
#include "patches.hpp"

namespace {

using marrow::similarity::Patch;
using marrow::similarity::PatchOptions;

std::shared_ptr<const marrow::Cost> patch_correlation(const marrow::Projector& projector,
                                                      const marrow::List<marrow::View>& views,
                                                      const marrow::List<marrow::Pose>* others,
                                                      const marrow::List<marrow::Projector>* other_projectors,
                                                      const PatchOptions& options) {
  return marrow::similarity::intensity_cost(
      projector, views, others, other_projectors, options, 2, [side = options.patch_pixels](const Patch& patch) {
        return 1 - marrow::similarity::mean_patch_correlation(patch, patch.rendered, patch.seen, patch.counts, side);
      });
}

}  // namespace

MARROW_PLUGIN(plugin) {
  auto node = plugin.node("similarity.patch_correlation", patch_correlation);
  node.summary(
      "1 - correlation of grey values within small squares, weighted by the radiograph's variance (LaRose 2001; Knaan "
      "and Joskowicz, MICCAI 2003)");
  marrow::similarity::declare_patches(node);
}
