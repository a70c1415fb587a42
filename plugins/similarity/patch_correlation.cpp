// SPDX-License-Identifier: Apache-2.0
#include "marrow/similarity/patches.hpp"

namespace {

using marrow::match::Patch;
using marrow::match::PatchOptions;

marrow::match::SumMeasure measure_of(const Patch&, const PatchOptions& options) {
  const auto add = [side = options.patch_pixels](const Patch& patch, marrow::match::Tally& tally) {
    marrow::match::add_patch_correlations(patch, patch.rendered, patch.seen, patch.counts, side, tally);
  };
  return {add, marrow::match::value_of_patch_correlations};
}

constexpr auto patch_correlation = marrow::match::intensity_node<measure_of, PatchOptions>;

}  // namespace

MARROW_PLUGIN(plugin) {
  auto node = plugin.node("similarity.patch_correlation", patch_correlation);
  node.summary(
          "1 - mean correlation of the grey values within small squares, weighted by the radiograph's variance (LaRose "
          "2001; Knaan and Joskowicz, MICCAI 2003)")
      .trait("unmoved_by_gain");
  marrow::match::declare_patches(node);
}
