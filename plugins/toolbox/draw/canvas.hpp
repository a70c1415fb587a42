// SPDX-License-Identifier: Apache-2.0
#pragma once
// Drawing for all pictures of a view: the X-ray in grey at a readable size, thin antialiased lines at sub-pixel
// positions, text.
#include <marrow/domain/camera.hpp>
#include <marrow/domain/features.hpp>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

namespace marrow::draw {

/// Colours in RGB order that colour-blind readers can distinguish (Okabe and Ito 2008).
inline const cv::Scalar kOrange(230, 159, 0), kSkyBlue(86, 180, 233), kGreen(0, 158, 115), kYellow(240, 228, 66),
    kPurple(204, 121, 167), kVermilion(213, 94, 0), kBlue(0, 114, 178), kWhite(255, 255, 255), kBlack(0, 0, 0),
    kGrey(150, 150, 150), kDark(32, 32, 32);

/// How grey values become brightness. linear, logarithmic: the grey values, or their logarithms, are stretched between
/// their 0.5th and 99.5th percentile inside the mask. local: logarithmic, then equalised by region with limited
/// contrast (CLAHE). This shows bone borders under any thickness.
enum class Contrast { linear, logarithmic, local };
/// Contrast by the name of an option: "linear" or "logarithmic". Any other name gives `local`.
Contrast contrast_of(const std::string& name);

/// A part of a view, drawn at another size.
struct Panel {
  cv::Mat pixels;       ///< CV_8UC3, RGB
  double scale = 1;     ///< panel pixels per image pixel
  cv::Point corner_px;  ///< image pixel at the panel's top left

  /// Position in the panel of a pixel position of the image.
  cv::Point2d at(double u_px, double v_px) const {
    return {(u_px - corner_px.x + 0.5) * scale - 0.5, (v_px - corner_px.y + 0.5) * scale - 0.5};
  }
};

/// A part of the view's image in grey. Its longer side becomes `size_px` long. A constant image becomes mid grey.
/// Pixels that are not finite become black. `part` must lie inside the image. Throws Error if check_view() refuses the
/// view or if the image does not have one channel.
Panel make_panel(const View& view, const cv::Rect& part, int size_px, Contrast contrast);
inline cv::Rect whole_image(const View& view) { return {0, 0, view.image.width(), view.image.height()}; }

/// An antialiased line between sub-pixel positions. Nothing is drawn if a position is not finite or lies far outside.
/// This also holds for dashes and dots.
void draw_line(cv::Mat& canvas, cv::Point2d from, cv::Point2d to, const cv::Scalar& colour, int thickness = 1);
void draw_dashes(cv::Mat& canvas, cv::Point2d from, cv::Point2d to, const cv::Scalar& colour, int thickness = 1);
void draw_dot(cv::Mat& canvas, cv::Point2d at, double radius, const cv::Scalar& colour);

/// Text that starts at `at`, on its baseline. Characters outside ASCII appear as '?'.
void draw_text(cv::Mat& canvas, const std::string& text, cv::Point at, const cv::Scalar& colour, double size = 0.5);
cv::Size text_size(const std::string& text, double size = 0.5);

void draw_segment(Panel& panel, const LineSegment& segment, const cv::Scalar& colour, int thickness);
/// Edge pixels as faint dots: half the colour, half the picture below.
void draw_edges(Panel& panel, const EdgeMap& edges, const cv::Scalar& colour);

/// One entry of a legend: a stroke in the colour, and its meaning.
struct LegendItem {
  std::string text;
  cv::Scalar colour;
};
/// The picture with the legend on a dark strip below it. The legend takes as many rows as it needs.
cv::Mat with_legend(const cv::Mat& picture, const std::vector<LegendItem>& items);

void draw_title(Panel& panel, const std::string& title);

}  // namespace marrow::draw
