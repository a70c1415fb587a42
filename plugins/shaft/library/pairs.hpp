// SPDX-License-Identifier: Apache-2.0
#pragma once
// Finds the two lines of an image that are the shaft's outer borders, and the reasons why other pairs are not.
#include <marrow/plugin.hpp>

#include "marrow/shaft/border.hpp"

namespace marrow::shaft {

/// See the help texts in declare_line_options().
struct LineOptions {
  double source_to_shaft_mm = 0;
  std::vector<double> width_mm, width_deviation_mm;
  double magnification_tolerance = 0.05;
  double min_length_mm = 25, max_angle_deg = 15;
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

/// Pairs nearly parallel lines with opposite gradients. The best pair is the most likely one by its width, its taper
/// and the length over which edge pixels support both borders. Rejected, with the reason, are pairs that are darker
/// outside (canal, gaps), too narrow (a cable), too wide (the limb) or not darker than their surroundings. Throws Error
/// if no pair is left.
ShaftLines best_pair(const EdgeMap& edges, const View& view, const std::vector<Border>& borders, const Scale& scale,
                     const LineOptions& options);

/// The ports and options of a node that calls best_pair().
template <class Builder>
void declare_line_options(Builder&& node) {
  node.in("edges", "edge pixels of the view")
      .in("view", "X-ray view; its camera and its grey values are used")
      .in("views", "all views of the bone: the shaft lies as deep as the point where their central rays meet",
          over("view"))
      .out("lines", "the two outer borders of the shaft, and the rejected pairs")
      .option("source_to_shaft_mm", &LineOptions::source_to_shaft_mm,
              "distance of the shaft from the X-ray source along the central ray; 0: that of the point where the views "
              "meet. If they do not, or are not wired, 600 mm are assumed, with a warning",
              at_least(0))
      .option("width_mm", &LineOptions::width_mm,
              "mean outer diameters, one for each direction from which the bone may be seen; none: a femur's, by level")
      .option("width_deviation_mm", &LineOptions::width_deviation_mm, "standard deviations of these diameters")
      .relation(same_length({"width_mm", "width_deviation_mm"}))
      .option("magnification_tolerance", &LineOptions::magnification_tolerance,
              "relative standard deviation of the magnification, because the shaft may lie nearer or deeper",
              at_least(0), at_most(1))
      .option("min_length_mm", &LineOptions::min_length_mm, "shortest common length of both borders, at the shaft",
              at_least(1))
      .option("max_angle_deg", &LineOptions::max_angle_deg, "largest angle between the borders: shafts taper",
              at_least(0), at_most(45))
      .option("tolerance_mm", &LineOptions::tolerance_mm,
              "largest distance of an edge pixel from its line, at the shaft", at_least(0.01))
      .option("gap_mm", &LineOptions::gap_mm, "widest gap that a border may have, at the shaft", at_least(0))
      .option("lines", &LineOptions::lines, "largest number of lines that are tried", at_least(2), at_most(1000))
      .option("least_log_likelihood", &LineOptions::least_log_likelihood,
              "least log-likelihood of a pair: 0.1 for each mm of clear borders, minus the cost of its width and taper")
      .option("outline", &LineOptions::outline,
              "move the borders outwards from the edges to the outline of the round bone, to correct for blur");
}

}  // namespace marrow::shaft
