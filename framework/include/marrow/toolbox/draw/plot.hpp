// SPDX-License-Identifier: Apache-2.0
#pragma once
// A small line plot: axes with round ticks, one curve, vertical marks.
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

namespace marrow::draw {

/// A vertical line at `x`.
struct PlotMark {
  double x = 0;
  cv::Scalar colour;
};

struct Plot {
  std::string title, x_label, y_label;
  std::vector<double> x, y;  ///< x increasing; y values that are not finite leave a gap
  std::vector<PlotMark> marks;
  std::optional<cv::Point2d> dot;  ///< a point of the curve that stands out
};

/// Draws the plot inside `area` of a CV_8UC3 canvas on white. Marks outside the range of x are not drawn.
void draw_plot(cv::Mat& canvas, const cv::Rect& area, const Plot& plot);

/// Round numbers (1, 2 or 5 times a power of ten apart), about `count` of them, inside [low, high].
std::vector<double> round_ticks(double low, double high, int count);

}  // namespace marrow::draw
