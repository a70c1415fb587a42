// SPDX-License-Identifier: Apache-2.0
#include "marrow/similarity/histogram.hpp"

namespace {

using marrow::match::bins_of;
using marrow::match::Patch;

struct Options : marrow::match::IntensityOptions {
  int bins = 64;

  /// The histogram is of the whole image: what a block adds to its entropy depends on all other blocks.
  Options() { has_blocks = false; }
};

/// Entropy of the whole image after scale * rendered is subtracted, divided by its entropy before. Bins cover the
/// image's own range, and the same range below it for values of the difference.
marrow::match::WholeMeasure measure_of(const Patch& whole, const Options& options) {
  const int bins = options.bins;
  marrow::match::Bins within = bins_of(whole.seen, whole.counts, bins);
  if (within.per_unit == 0) return {[](const Patch&) { return 1.0; }, {}};
  // The lowest integral, often that of the background, lies in the middle of its bin.
  within.low -= (bins + 0.5) / within.per_unit;
  within.count = 2 * bins + 1;
  std::vector<double> image(static_cast<std::size_t>(within.count));
  double n = 0;
  for (std::size_t i = 0; i < whole.seen.size(); ++i)
    if (whole.counts[i]) image[std::size_t(within.of(whole.seen[i]))] += 1, n += 1;
  const double before = marrow::match::entropy(image, n);
  const auto value = [=](const Patch& patch) {
    const double scale = marrow::match::scale_of(marrow::match::gradients_of(patch)).value;
    if (!(scale > 0) || !(before > 0)) return 1.0;
    std::vector<double> histogram = image;
    for (std::size_t i = 0; i < patch.seen.size(); ++i) {
      if (!patch.counts[i] || patch.rendered[i] == 0) continue;
      histogram[std::size_t(within.of(patch.seen[i]))] -= 1;
      histogram[std::size_t(within.of(patch.seen[i] - scale * patch.rendered[i]))] += 1;
    }
    return std::min(2.0, marrow::match::entropy(histogram, n) / before);
  };
  return {value, {}};
}

constexpr auto entropy_of_difference = marrow::match::intensity_node<measure_of, Options>;

}  // namespace

MARROW_PLUGIN(plugin) {
  auto node = plugin.node("similarity.entropy_of_difference", entropy_of_difference);
  node.summary(
          "Entropy of the difference between image and radiograph, divided by the entropy of the image (Buzug et al. "
          "1997; Penney et al., IEEE Trans Med Imaging 1998); it predicts no deviations")
      .trait("unmoved_by_gain");
  marrow::match::declare<Options>(node);
  node.option("bins", &Options::bins, "number of bins of the histogram over the image's range of values",
              marrow::at_least(4), marrow::at_most(1024));
}
