// SPDX-License-Identifier: Apache-2.0
// Draws the pair of lines that was chosen as the shaft's outer borders, and the rejected pairs with the reasons (Fig. 4
// of the chapter).
#include <marrow/plugin.hpp>

#include "marrow/toolbox/draw/canvas.hpp"

namespace {

using namespace marrow::draw;

struct Options {
  int size_px = 1000;
  std::string contrast = "local";
  int rejected = 4;
};

std::string describe(const marrow::ShaftLines& lines) {
  return marrow::formatted("chosen: {:.1f} +- {:.1f} mm wide, log likelihood {:.2f}", lines.width_mm,
                           lines.width_deviation_mm, lines.log_likelihood);
}

/// Draws a number beside the upper end of a line. The legend gives the reason of the rejection with this number.
void draw_number(Panel& panel, const marrow::LineSegment& line, std::size_t number, const cv::Scalar& colour) {
  const Eigen::Vector2d& upper = line.from_px.y() < line.to_px.y() ? line.from_px : line.to_px;
  if (!upper.allFinite()) return;
  const cv::Point2d at = panel.at(upper.x(), upper.y());
  const cv::Point place(std::clamp(int(at.x) + 4, 0, std::max(0, panel.pixels.cols - 20)),
                        std::clamp(int(at.y) + 16, 16, std::max(16, panel.pixels.rows - 4)));
  draw_text(panel.pixels, marrow::formatted("{}", number), place, colour);
}

/// The line midway between the borders.
marrow::LineSegment mid_line(const marrow::ShaftLines& lines) {
  return {0.5 * (lines.left.from_px + lines.right.from_px), 0.5 * (lines.left.to_px + lines.right.to_px)};
}

marrow::Picture shaft(const marrow::ShaftLines& lines, const marrow::View& view, const marrow::EdgeMap* edges,
                      const Options& options) {
  Panel panel = make_panel(view, whole_image(view), options.size_px, contrast_of(options.contrast));
  if (edges) draw_edges(panel, *edges, kVermilion);
  std::vector<LegendItem> legend{{describe(lines), kSkyBlue}};
  if (edges) legend.push_back({"edges", kVermilion});
  const std::size_t count = std::min(lines.rejected.size(), std::size_t(options.rejected));
  for (std::size_t i = 0; i < count; ++i) {
    const marrow::ShaftLines::Rejected& pair = lines.rejected[i];
    draw_segment(panel, pair.left, kOrange, 1);
    draw_segment(panel, pair.right, kOrange, 1);
    draw_number(panel, pair.left, i + 1, kOrange);
    legend.push_back({marrow::formatted("rejected {}: {}", i + 1, pair.reason), kOrange});
  }
  if (count < lines.rejected.size())
    legend.push_back({marrow::formatted("{} more rejected pairs are not drawn", lines.rejected.size() - count), kGrey});
  draw_segment(panel, lines.left, kSkyBlue, 2);
  draw_segment(panel, lines.right, kSkyBlue, 2);
  draw_segment(panel, mid_line(lines), kSkyBlue, 1);
  draw_title(panel, view.name);
  return {with_legend(panel.pixels, legend)};
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("render.shaft", shaft)
      .summary("Draws the shaft's borders found in a view, and the rejected pairs of lines with the reasons")
      .in("lines", "borders found in the view")
      .in("view", "X-ray view")
      .in("edges", "edges of the view; drawn as faint dots")
      .out("picture", "the view with the lines and a legend")
      .option("size_px", &Options::size_px, "longer side of the view", marrow::at_least(64), marrow::at_most(8192))
      .option("contrast", &Options::contrast, "how grey values are shown",
              marrow::one_of({"local", "logarithmic", "linear"}))
      .option("rejected", &Options::rejected, "number of rejected pairs to draw, the best first", marrow::at_least(0),
              marrow::at_most(100));
}
