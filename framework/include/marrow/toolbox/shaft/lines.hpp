// SPDX-License-Identifier: Apache-2.0
#pragma once
// The common part of the shaft nodes before borders are paired: options, and lines that edge pixels support.
#include <marrow/domain/camera.hpp>
#include <vector>

#include "marrow/toolbox/shaft/border.hpp"

namespace marrow::shaft {

/// See the help texts in declare_line_options().
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

/// The lengths of the options in pixels of a view, at the depth of the isocentre (the world's origin).
struct Scale {
  double pixel_mm = 1;  ///< mm per pixel at that depth
  double min_length_px = 0, gap_px = 0;
  Support support;
};

/// Throws Error if the view or its image type is not valid, if edge map and view have different sizes, if the edge map
/// is empty or holds NaN or infinity, or if the isocentre does not lie in front of the source.
Scale checked_scale(const EdgeMap& edges, const View& view, const LineOptions& options);

/// Fits the candidates to the longest run of edge pixels that support them. Candidates without enough support and those
/// that repeat an earlier one are left out. At most options.lines.
std::vector<Border> supported_lines(const EdgeMap& edges, const std::vector<Border>& candidates, const Scale& scale,
                                    const LineOptions& options);

}  // namespace marrow::shaft
