// SPDX-License-Identifier: Apache-2.0
#include <marrow/plugin.hpp>

#include "marrow/toolbox/match/intensity.hpp"

namespace {

using marrow::match::IntensityOptions;
using marrow::match::Patch;

std::shared_ptr<const marrow::Cost> normalised_cross_correlation(
    const marrow::Projector& projector, const marrow::List<marrow::View>& views,
    const marrow::List<marrow::Pose>* others, const marrow::List<marrow::Projector>* other_projectors,
    const IntensityOptions& options) {
  return marrow::match::intensity_cost(projector, views, others, other_projectors, options, 2, [](const Patch& patch) {
    return 1 - marrow::match::correlation(patch.rendered, patch.seen, patch.counts);
  });
}

}  // namespace

MARROW_PLUGIN(plugin) {
  auto node = plugin.node("similarity.normalised_cross_correlation", normalised_cross_correlation);
  node.summary("1 - normalised cross-correlation of radiograph and image (Penney et al., IEEE Trans Med Imaging 1998)");
  marrow::match::declare<decltype(node), IntensityOptions>(node);
}
