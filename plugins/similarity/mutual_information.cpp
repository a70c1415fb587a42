// SPDX-License-Identifier: Apache-2.0
#include <marrow/plugin.hpp>
#include <numeric>

#include "marrow/similarity/histogram.hpp"

namespace {

using marrow::match::bins_of;
using marrow::match::Patch;

struct Options : marrow::match::IntensityOptions {
  int bins = 32;

  /// The histogram is of all pixels: what a block adds to its entropy depends on all other blocks.
  Options() { has_blocks = false; }
};

/// 2 - (H(a) + H(b)) / H(a, b): 0 if a and b determine each other, 1 if they are independent.
double value(const Patch& patch, const Options& options) {
  const int bins = options.bins;
  const auto a = bins_of(patch.rendered, patch.counts, bins), b = bins_of(patch.seen, patch.counts, bins);
  std::vector<double> joint(std::size_t(bins) * std::size_t(bins)), of_a(static_cast<std::size_t>(bins)),
      of_b(static_cast<std::size_t>(bins));
  double n = 0;
  for (std::size_t i = 0; i < patch.seen.size(); ++i) {
    if (!patch.counts[i]) continue;
    const std::size_t x = std::size_t(a.of(patch.rendered[i])), y = std::size_t(b.of(patch.seen[i]));
    joint[x * std::size_t(bins) + y] += 1, of_a[x] += 1, of_b[y] += 1, n += 1;
  }
  if (n < 16) return 1;
  const double together = marrow::match::entropy(joint, n), rendered = marrow::match::entropy(of_a, n),
               seen = marrow::match::entropy(of_b, n);
  return rendered > 0 && seen > 0 ? 2 - (rendered + seen) / together : 1;
}

constexpr auto mutual_information = marrow::match::intensity_node<value, Options, 1>;

}  // namespace

MARROW_PLUGIN(plugin) {
  auto node = plugin.node("similarity.mutual_information", mutual_information);
  node.summary(
          "2 - normalised mutual information; it assumes no particular relation between the grey values (Studholme et "
          "al. 1999; Penney et al. 1998); it predicts no deviations")
      .trait("unmoved_by_gain");
  marrow::match::declare<Options>(node);
  node.option("bins", &Options::bins, "number of bins of each histogram", marrow::at_least(4), marrow::at_most(256));
}
