// SPDX-License-Identifier: Apache-2.0
// Prewitt's mask (in: Picture Processing and Psychopictorics, 1970): central differences over 3 x 3 pixels, averaged
// across their direction.
#include "marrow/edges/threshold.hpp"

namespace {

using namespace marrow::edges;

marrow::EdgeMap prewitt(const marrow::View& view, const ThresholdOptions& options, marrow::Context& context) {
  static const Kernel kMask{{1 / 3.0f, 1 / 3.0f, 1 / 3.0f}, {-0.5f, 0, 0.5f}};
  return mask_edges(view, options, kMask, context);
}

}  // namespace

MARROW_PLUGIN(plugin) {
  declare_mask(
      plugin.node("edges.prewitt", prewitt)
          .summary("Prewitt's mask of 3 x 3 pixels (1970) with thinning and one threshold, in multiples of the image's "
                   "noise"));
}
