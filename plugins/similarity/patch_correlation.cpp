// SPDX-License-Identifier: Apache-2.0
#include "marrow/similarity/patches.hpp"

namespace {

using marrow::match::Patch;
using marrow::match::PatchOptions;

marrow::match::SumMeasure measure_of(const Patch&, const PatchOptions& options) {
  return marrow::match::correlation_in_squares(options.patch_pixels,
                                               [](const Patch& patch) { return std::vector<Patch>{patch}; });
}

constexpr auto patch_correlation = marrow::match::intensity_node<measure_of, PatchOptions>;

}  // namespace

MARROW_PLUGIN(plugin) {
  auto node = plugin.node("similarity.patch_correlation", patch_correlation);
  node.summary(
          "1 - mean correlation of the grey values within small squares, weighted by the radiograph's variance (LaRose "
          "2001; Knaan and Joskowicz, MICCAI 2003)")
      .trait("unmoved_by_gain")
      .trait("derivatives");
  marrow::match::declare_patches(node);
}
