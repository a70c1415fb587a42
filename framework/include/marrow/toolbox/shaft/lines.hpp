// SPDX-License-Identifier: Apache-2.0
#pragma once
// What the shaft nodes have in common before borders are paired: their options, and lines that edge pixels support.
#include <marrow/domain/camera.hpp>
#include <vector>

#include "marrow/toolbox/shaft/border.hpp"

namespace marrow::shaft {

struct LineOptions {
  std::vector<double> width_mm, width_deviation_mm;
  double magnification_tolerance = 0.05;
  double min_length_mm = 25;
  double max_angle_deg = 15;
  double tolerance_mm = 1.0;
  double gap_mm = 8;
  int lines = 60;
  double least_log_likelihood = 2;
  bool outline = true;
};

/// The options' lengths in pixels of a view, at the depth of the isocentre (the world's origin).
struct Scale {
  double pixel_mm = 1;
  double min_length_px = 0, gap_px = 0;
  Support support;
};

/// Throws Error where edges and view do not go together, there is no edge, or the isocentre lies behind the source.
Scale checked_scale(const EdgeMap& edges, const View& view, const LineOptions& options);

/// Candidates fitted to the edge pixels that support them and cut to the longest run of these; those that the pixels do
/// not support, or that repeat an earlier one, are left out. At most options.lines.
std::vector<Border> supported_lines(const EdgeMap& edges, const std::vector<Border>& candidates, const Scale& scale,
                                    const LineOptions& options);

}  // namespace marrow::shaft
