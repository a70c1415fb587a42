// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include "marrow/domain/quantile.hpp"
#include "marrow/similarity/intensity.hpp"

namespace {

using marrow::match::Patch;

/// No blocks: the pixels compared change with the pose, and each block alone would choose others.
struct Options : marrow::match::IntensityOptions {
  Options() { has_blocks = false; }
};

/// The median length of the gradients that count and are not zero but for rounding.
double median_length(const std::vector<float>& u, const std::vector<float>& v, const std::vector<char>& counts) {
  constexpr double kRounding = 1e-4;  // of the longest
  std::vector<double> lengths;
  for (std::size_t i = 0; i < u.size(); ++i)
    if (counts[i]) lengths.push_back(std::hypot(u[i], v[i]));
  if (lengths.empty()) return INFINITY;
  const double longest = *std::max_element(lengths.begin(), lengths.end());
  std::erase_if(lengths, [&](double length) { return !(length > kRounding * longest); });
  return lengths.empty() ? INFINITY : marrow::quantile_in_place(lengths, 0.5);
}

/// Mean of (1 - cos(angle)) / 2 over the pixels where both gradients are longer than their medians. If these are less
/// than a tenth of the pixels, the missing ones count as 1.
double value(const Patch& patch) {
  const marrow::match::Gradients g = marrow::match::gradients_of(patch);
  const double least_rendered = median_length(g.u.rendered, g.v.rendered, g.u.counts),
               least_seen = median_length(g.u.seen, g.v.seen, g.u.counts);
  double used = 0, sum = 0, all = 0;
  for (std::size_t i = 0; i < g.u.counts.size(); ++i) {
    if (!g.u.counts[i]) continue;
    all += 1;
    const double a = std::hypot(g.u.rendered[i], g.v.rendered[i]), b = std::hypot(g.u.seen[i], g.v.seen[i]);
    if (a < least_rendered || b < least_seen || a == 0 || b == 0) continue;
    used += 1;
    sum += 0.5 * (1 + (double(g.u.rendered[i]) * g.u.seen[i] + double(g.v.rendered[i]) * g.v.seen[i]) / (a * b));
  }
  return used > 0 ? 1 - sum / std::max(used, 0.1 * all) : 1;
}

constexpr auto gradient_orientation = marrow::match::intensity_node<value, Options, 1>;

}  // namespace

MARROW_PLUGIN(plugin) {
  auto node = plugin.node("similarity.gradient_orientation", gradient_orientation);
  node.summary(
          "Difference between the directions of the gradients (after De Silva et al., Phys Med Biol 2016, with the "
          "cosine instead of the logarithm); it predicts no deviations")
      .trait("unmoved_by_gain");
  marrow::match::declare<Options>(node);
}
