// SPDX-License-Identifier: Apache-2.0
#pragma once
// A small line plot: axes with ticks at round numbers, one curve, vertical marks.
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
  std::vector<double> x, y;  ///< of equal size; x increases; values of y that are not finite leave a gap
  std::vector<PlotMark> marks;
  std::optional<cv::Point2d> dot;  ///< a point of the curve to highlight
};

/// Draws the plot on white into `area` of a CV_8UC3 canvas. Marks outside the range of x are not drawn.
void draw_plot(cv::Mat& canvas, const cv::Rect& area, const Plot& plot);

/// About `count` round numbers inside [low, high]. Their distance is 1, 2 or 5 times a power of ten.
std::vector<double> round_ticks(double low, double high, int count);

}  // namespace marrow::draw
