// SPDX-License-Identifier: Apache-2.0
#include <marrow/plugin.hpp>

#include "marrow/toolbox/match/intensity.hpp"

namespace {

using marrow::match::IntensityOptions;
using marrow::match::Patch;

double value(const Patch& patch) {
  const marrow::match::Gradients g = marrow::match::gradients_of(patch);
  using marrow::match::correlation;
  return 1 - 0.5 * (correlation(g.rendered_u, g.seen_u, g.counts) + correlation(g.rendered_v, g.seen_v, g.counts));
}

std::shared_ptr<const marrow::Cost> gradient_correlation(const marrow::Projector& projector,
                                                         const marrow::List<marrow::View>& views,
                                                         const marrow::List<marrow::Pose>* others,
                                                         const marrow::List<marrow::Projector>* other_projectors,
                                                         const IntensityOptions& options) {
  return marrow::match::intensity_cost(projector, views, others, other_projectors, options, 2, value);
}

}  // namespace

MARROW_PLUGIN(plugin) {
  auto node = plugin.node("similarity.gradient_correlation", gradient_correlation);
  node.summary(
      "1 - mean correlation of the horizontal and of the vertical gradients (Penney et al., IEEE Trans Med Imaging "
      "1998)");
  marrow::match::declare<decltype(node), IntensityOptions>(node);
}
