// SPDX-License-Identifier: Apache-2.0
#pragma once
// Which two of an image's lines are the shaft's outer borders, and why the others are not.
#include <marrow/plugin.hpp>

#include "marrow/toolbox/shaft/lines.hpp"

namespace marrow::shaft {

/// Pairs nearly parallel lines of opposite gradient. The best is the likeliest by its width, its taper and the length
/// on which edge pixels support both borders; the canal and gaps (dark outside), what is too narrow (a cable) or too
/// wide (the limb) and what is not darker than its surroundings are turned away with their reasons. Throws Error when
/// no pair is left.
ShaftLines best_pair(const EdgeMap& edges, const View& view, const std::vector<Border>& borders, const Scale& scale,
                     const LineOptions& options);

/// The options of a node that calls best_pair().
template <class Builder>
void declare_line_options(Builder&& node) {
  node.option("width_mm", &LineOptions::width_mm,
              "mean outer diameters, one for each direction from which the bone may be seen; none: a femur's, by level")
      .option("width_deviation_mm", &LineOptions::width_deviation_mm, "their standard deviations")
      .relation(same_length({"width_mm", "width_deviation_mm"}))
      .option("magnification_tolerance", &LineOptions::magnification_tolerance,
              "standard deviation of the magnification, as a fraction: the shaft need not lie at the isocentre",
              at_least(0), at_most(1))
      .option("min_length_mm", &LineOptions::min_length_mm,
              "shortest stretch, at the isocentre, that both borders share", at_least(1))
      .option("max_angle_deg", &LineOptions::max_angle_deg, "largest angle between the borders: shafts taper",
              at_least(0), at_most(45))
      .option("tolerance_mm", &LineOptions::tolerance_mm,
              "largest distance, at the isocentre, of an edge pixel from its line", at_least(0.01))
      .option("gap_mm", &LineOptions::gap_mm, "widest gap, at the isocentre, that a border may have", at_least(0))
      .option("lines", &LineOptions::lines, "largest number of lines that are tried", at_least(2), at_most(1000))
      .option("least_log_likelihood", &LineOptions::least_log_likelihood,
              "of a pair that is taken: 0.1 for each mm of clear borders, less what its width and taper cost")
      .option("outline", &LineOptions::outline,
              "move the borders from the edges, which blur draws inwards, to the outline of the round bone");
}

}  // namespace marrow::shaft
