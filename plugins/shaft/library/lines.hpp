// SPDX-License-Identifier: Apache-2.0
#pragma once
// The common part of the shaft nodes before borders are paired: options, and lines that edge pixels support.
#include <marrow/domain/camera.hpp>
#include <marrow/domain/list.hpp>
#include <marrow/runtime/node/context.hpp>
#include <vector>

#include "marrow/shaft/border.hpp"

namespace marrow::shaft {

/// See the help texts in declare_line_options().
struct LineOptions {
  double source_to_shaft_mm = 0;
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

/// Lengths in a view at the depth of the shaft.
struct Scale {
  double pixel_mm = 1;                                       ///< size of a pixel, as pixel_size_at_mm() has it
  Eigen::Matrix2d mm_from_px = Eigen::Matrix2d::Identity();  ///< of offsets in the image; pixels may not be square
  double min_length_px = 0, gap_px = 0;
  Support support;

  double length_mm(const Eigen::Vector2d& offset_px) const { return (mm_from_px * offset_px).norm(); }
  /// How long `offset_px` is across a direction of the image.
  double across_mm(const Eigen::Vector2d& offset_px, const Eigen::Vector2d& along_px) const;
};

/// The distance of the shaft from the source is that of the options, else that of the point where all the views meet.
/// Without both it is a usual C-arm's 600 mm, with a warning. `views` may be null. Throws Error if the view or its
/// image type is not valid, if edge map and view have different sizes, or if the edge map is empty or holds NaN or
/// infinity.
Scale checked_scale(const EdgeMap& edges, const View& view, const List<View>* views, const LineOptions& options,
                    Context& context);

/// Fits the candidates to the longest run of edge pixels that support them. Candidates without enough support and those
/// that repeat an earlier one are left out. At most options.lines.
std::vector<Border> supported_lines(const EdgeMap& edges, const std::vector<Border>& candidates, const Scale& scale,
                                    const LineOptions& options);

}  // namespace marrow::shaft
