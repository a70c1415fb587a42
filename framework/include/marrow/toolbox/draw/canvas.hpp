// SPDX-License-Identifier: Apache-2.0
#pragma once
// What the pictures of a view share: the X-ray in grey at a readable size, thin antialiased lines at sub-pixel
// positions, text.
#include <marrow/domain/camera.hpp>
#include <marrow/domain/features.hpp>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

namespace marrow::draw {

/// Colours in RGB order, told apart by colour-blind readers (Okabe and Ito 2008).
inline const cv::Scalar kOrange(230, 159, 0), kSkyBlue(86, 180, 233), kGreen(0, 158, 115), kYellow(240, 228, 66),
    kPurple(204, 121, 167), kVermilion(213, 94, 0), kBlue(0, 114, 178), kWhite(255, 255, 255), kBlack(0, 0, 0),
    kGrey(150, 150, 150), kDark(32, 32, 32);

/// How grey values become brightness. linear, logarithmic: between the 0.5th and 99.5th percentile of the pixels inside
/// the mask. local: then equalised by region with limited contrast (CLAHE), which shows bone borders under any
/// thickness.
enum class Contrast { linear, logarithmic, local };
/// By the name of an option: "linear", "logarithmic" or "local".
Contrast contrast_of(const std::string& name);

/// A part of a view drawn at another size.
struct Panel {
  cv::Mat pixels;       ///< CV_8UC3, RGB
  double scale = 1;     ///< panel pixels per image pixel
  cv::Point corner_px;  ///< image pixel at the panel's top left

  /// Where a pixel position of the image lies in the panel.
  cv::Point2d at(double u_px, double v_px) const {
    return {(u_px - corner_px.x + 0.5) * scale - 0.5, (v_px - corner_px.y + 0.5) * scale - 0.5};
  }
};

/// A part of the view's image in grey, its longer side `size_px` long. A constant image becomes mid grey; pixels that
/// are not finite are black.
Panel make_panel(const View& view, const cv::Rect& part, int size_px, Contrast contrast);
inline cv::Rect whole_image(const View& view) { return {0, 0, view.image.width(), view.image.height()}; }

/// An antialiased line between sub-pixel positions; positions that are not finite or far outside draw nothing.
void draw_line(cv::Mat& canvas, cv::Point2d from, cv::Point2d to, const cv::Scalar& colour, int thickness = 1);
void draw_dashes(cv::Mat& canvas, cv::Point2d from, cv::Point2d to, const cv::Scalar& colour, int thickness = 1);
void draw_dot(cv::Mat& canvas, cv::Point2d at, double radius, const cv::Scalar& colour);

/// Text with its left end on the baseline `at`; characters outside ASCII come out as '?'.
void draw_text(cv::Mat& canvas, const std::string& text, cv::Point at, const cv::Scalar& colour, double size = 0.5);
cv::Size text_size(const std::string& text, double size = 0.5);

void draw_segment(Panel& panel, const LineSegment& segment, const cv::Scalar& colour, int thickness);
/// Edge pixels as faint dots: half of the colour, half of what lies below.
void draw_edges(Panel& panel, const EdgeMap& edges, const cv::Scalar& colour);

/// One line of a legend: a stroke of the colour and what it stands for.
struct LegendItem {
  std::string text;
  cv::Scalar colour;
};
/// The picture with a dark strip beneath it that holds the legend, wrapped into as many rows as it needs.
cv::Mat with_legend(const cv::Mat& picture, const std::vector<LegendItem>& items);

void draw_title(Panel& panel, const std::string& title);

}  // namespace marrow::draw
