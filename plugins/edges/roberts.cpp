// SPDX-License-Identifier: Apache-2.0
// Roberts' cross (in: Optical and Electro-Optical Information Processing, 1965). Roberts takes the differences along
// the two diagonals of 2 x 2 pixels. Rotated by 45 degrees, these are the differences between the means of opposite
// sides.
#include "marrow/edges/threshold.hpp"

namespace {

using namespace marrow::image;

marrow::EdgeMap roberts(const marrow::View& view, const ThresholdOptions& options, marrow::Context& context) {
  static const Kernel kMask{{0.5f, 0.5f}, {-1, 1}};
  return mask_edges(view, options, kMask, context);
}

}  // namespace

MARROW_PLUGIN(plugin) {
  declare_threshold_options(
      plugin.node("edges.roberts", roberts)
          .summary(
              "Roberts' mask of 2 x 2 pixels (1965) with thinning and one threshold, in multiples of the image's noise")
          .in("view", "X-ray view")
          .out("edges", "edge pixels at sub-pixel positions")
          .option("sigma_px", &ThresholdOptions::sigma_px,
                  "standard deviation of the Gaussian that smooths the image first; 0: no smoothing",
                  marrow::at_least(0), marrow::at_most(10)));
}
