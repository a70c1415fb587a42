// SPDX-License-Identifier: Apache-2.0
#include <marrow/plugin.hpp>

#include "histogram.hpp"

namespace {

using marrow::similarity::bins_of;
using marrow::similarity::Patch;

struct Options : marrow::similarity::IntensityOptions {
  int bins = 64;
};

/// Entropy of the histogram of seen - scale * rendered, over its greatest possible value. Bins are as wide as the image's own grey
/// values spread, so that a smaller spread of the difference shows.
double value(const Patch& patch, int bins) {
  const double scale = marrow::similarity::fit_of(patch).scale;
  if (!(scale > 0)) return 1;
  const auto seen = bins_of(patch.seen, patch.counts, bins);
  if (seen.per_unit == 0) return 1;
  std::vector<float> difference(patch.seen.size());
  for (std::size_t i = 0; i < difference.size(); ++i) difference[i] = patch.seen[i] - float(scale) * patch.rendered[i];
  auto own = bins_of(difference, patch.counts, bins);
  own.per_unit = seen.per_unit;
  std::vector<double> histogram(static_cast<std::size_t>(bins));
  double n = 0;
  for (std::size_t i = 0; i < difference.size(); ++i)
    if (patch.counts[i]) histogram[std::size_t(own.of(difference[i]))] += 1, n += 1;
  return n < 16 ? 1 : marrow::similarity::entropy(histogram, n) / std::log(double(bins));
}

std::shared_ptr<const marrow::Cost> entropy_of_difference(const marrow::Projector& projector, const marrow::List<marrow::View>& views, const marrow::List<marrow::Pose>* others,
    const marrow::List<marrow::Projector>* other_projectors, const Options& options) {
  return marrow::similarity::intensity_cost(projector, views, others, other_projectors, options, 1, [bins = options.bins](const Patch& patch) { return value(patch, bins); });
}

}  // namespace

MARROW_PLUGIN(plugin) {
  auto node = plugin.node("similarity.entropy_of_difference", entropy_of_difference);
  node.summary("Entropy of the difference image (Buzug et al. 1997; Penney et al., IEEE Trans Med Imaging 1998)");
  marrow::similarity::declare<decltype(node), Options>(node);
  node.option("bins", &Options::bins, "of the histogram, as wide as of the image's", marrow::at_least(4), marrow::at_most(1024));
}
