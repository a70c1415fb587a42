// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/match/patches.hpp"

namespace {

using marrow::match::Patch;
using marrow::match::PatchOptions;

double value(const Patch& patch, const PatchOptions& options) {
  return 1 -
         marrow::match::mean_patch_correlation(patch, patch.rendered, patch.seen, patch.counts, options.patch_pixels);
}

constexpr auto patch_correlation = marrow::match::intensity_node<value, PatchOptions>;

}  // namespace

MARROW_PLUGIN(plugin) {
  auto node = plugin.node("similarity.patch_correlation", patch_correlation);
  node.summary(
          "1 - mean correlation of the grey values within small squares, weighted by the radiograph's variance (LaRose "
          "2001; Knaan and Joskowicz, MICCAI 2003)")
      .trait("unmoved_by_gain");
  marrow::match::declare_patches(node);
}
