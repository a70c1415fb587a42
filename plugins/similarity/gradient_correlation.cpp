// SPDX-License-Identifier: Apache-2.0
#include <marrow/plugin.hpp>

#include "intensity.hpp"

namespace {

using marrow::similarity::IntensityOptions;
using marrow::similarity::Patch;

double value(const Patch& patch) {
  const marrow::similarity::Gradients g = marrow::similarity::gradients_of(patch);
  using marrow::similarity::correlation;
  return 1 - 0.5 * (correlation(g.rendered_u, g.seen_u, g.counts) + correlation(g.rendered_v, g.seen_v, g.counts));
}

std::shared_ptr<const marrow::Cost> gradient_correlation(const marrow::Projector& projector,
                                                         const marrow::List<marrow::View>& views,
                                                         const marrow::List<marrow::Pose>* others,
                                                         const marrow::List<marrow::Projector>* other_projectors,
                                                         const IntensityOptions& options) {
  return marrow::similarity::intensity_cost(projector, views, others, other_projectors, options, 2, value);
}

}  // namespace

MARROW_PLUGIN(plugin) {
  auto node = plugin.node("similarity.gradient_correlation", gradient_correlation);
  node.summary(
      "1 - mean correlation of the horizontal and of the vertical gradients (Penney et al., IEEE Trans Med Imaging "
      "1998)");
  marrow::similarity::declare<decltype(node), IntensityOptions>(node);
}
