// SPDX-License-Identifier: Apache-2.0
#include <marrow/plugin.hpp>

#include "intensity.hpp"

namespace {

using marrow::similarity::IntensityOptions;
using marrow::similarity::Patch;

/// Mean of A / (A + d^2), with d the difference of gradients and A the variance of the image's; 0 where the image is constant.
double term(const std::vector<float>& rendered, const std::vector<float>& seen, const std::vector<char>& counts, double scale) {
  double n = 0, sum = 0, squares = 0;
  for (std::size_t i = 0; i < seen.size(); ++i) {
    if (!counts[i]) continue;
    n += 1, sum += seen[i], squares += double(seen[i]) * seen[i];
  }
  const double variance = n > 15 ? squares / n - sum * sum / (n * n) : 0;
  if (!(variance > 1e-14)) return 0;
  double total = 0;
  for (std::size_t i = 0; i < seen.size(); ++i) {
    if (!counts[i]) continue;
    const double difference = seen[i] - scale * rendered[i];
    total += variance / (variance + difference * difference);
  }
  return total / n;
}

/// The factor of the rendered gradients is the least-squares one of the grey values.
double value(const Patch& patch) {
  const double scale = marrow::similarity::fit_of(patch).scale;
  if (!(scale > 0)) return 1;
  const marrow::similarity::Gradients g = marrow::similarity::gradients_of(patch);
  return 1 - 0.5 * (term(g.rendered_u, g.seen_u, g.counts, scale) + term(g.rendered_v, g.seen_v, g.counts, scale));
}

std::shared_ptr<const marrow::Cost> gradient_difference(const marrow::Projector& projector, const marrow::List<marrow::View>& views, const marrow::List<marrow::Pose>* others,
    const marrow::List<marrow::Projector>* other_projectors, const IntensityOptions& options) {
  return marrow::similarity::intensity_cost(projector, views, others, other_projectors, options, 1, value);
}

}  // namespace

MARROW_PLUGIN(plugin) {
  auto node = plugin.node("similarity.gradient_difference", gradient_difference);
  node.summary("1 - gradient difference, which thin bright lines hardly disturb (Penney et al., IEEE Trans Med Imaging 1998)");
  marrow::similarity::declare<decltype(node), IntensityOptions>(node);
}
