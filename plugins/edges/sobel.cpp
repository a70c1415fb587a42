// SPDX-License-Identifier: Apache-2.0
// Sobel's mask (Stanford Artificial Intelligence Project, 1968): central differences over 3 x 3 pixels, averaged across
// their direction with double weight in the middle.
#include "marrow/edges/threshold.hpp"

namespace {

using namespace marrow::edges;

marrow::EdgeMap sobel(const marrow::View& view, const ThresholdOptions& options, marrow::Context& context) {
  static const Kernel kMask{{0.25f, 0.5f, 0.25f}, {-0.5f, 0, 0.5f}};
  return mask_edges(view, options, kMask, context);
}

}  // namespace

MARROW_PLUGIN(plugin) {
  declare_mask(plugin.node("edges.sobel", sobel)
                   .summary("Sobel's mask of 3 x 3 pixels (1968) with thinning and one threshold, in multiples of the "
                            "image's noise"));
}
