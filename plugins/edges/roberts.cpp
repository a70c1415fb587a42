// SPDX-License-Identifier: Apache-2.0
// Roberts' cross (in: Optical and Electro-Optical Information Processing, 1965). Roberts takes the differences along
// the two diagonals of 2 x 2 pixels. Rotated by 45 degrees, these are the differences between the means of opposite
// sides.
#include "marrow/edges/threshold.hpp"

namespace {

using namespace marrow::edges;

marrow::EdgeMap roberts(const marrow::View& view, const ThresholdOptions& options, marrow::Context& context) {
  static const Kernel kMask{{0.5f, 0.5f}, {-1, 1}};
  return mask_edges(view, options, kMask, context);
}

}  // namespace

MARROW_PLUGIN(plugin) {
  declare_mask(plugin.node("edges.roberts", roberts)
                   .summary("Roberts' mask of 2 x 2 pixels (1965) with thinning and one threshold, in multiples of the "
                            "image's noise"));
}
