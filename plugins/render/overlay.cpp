// SPDX-License-Identifier: Apache-2.0
// Draws the model's outline over an X-ray view, before and after registration (Fig. 8 of the chapter).
#include <marrow/plugin.hpp>

#include "marrow/toolbox/draw/canvas.hpp"

namespace {

using namespace marrow::draw;

struct Options {
  int size_px = 800;
  std::string contrast = "local";
  double contour_spacing_px = 1;
  bool zoom = false;
};

/// One outline to draw. Later layers cover earlier ones.
struct Layer {
  std::string text;
  cv::Scalar colour;
  int thickness;
  std::vector<marrow::OutlinePoint> outline;
};

Layer make_layer(const std::string& text, const cv::Scalar& colour, int thickness,
                 const marrow::OutlineProjector& projector, const marrow::View& view,
                 const marrow::RigidTransform& pose, const Options& options) {
  marrow::check_rigid(pose, "pose '" + text + "'");
  Layer layer{text, colour, thickness, projector.outline(view.camera, pose, options.contour_spacing_px)};
  if (layer.outline.empty()) layer.text += ": outside the image";
  return layer;
}

/// The points of an outline come in any order, so each is drawn as a short stroke along the outline.
void draw_outline(Panel& panel, const Layer& layer, double spacing_px) {
  const double half = 0.5 * spacing_px * panel.scale;
  for (const marrow::OutlinePoint& point : layer.outline) {
    const cv::Point2d at = panel.at(point.u_px, point.v_px), along(-point.normal_v * half, point.normal_u * half);
    draw_line(panel.pixels, at - along, at + along, layer.colour, layer.thickness);
  }
}

/// The part of the image that contains all outlines, with a margin of a tenth on each side. The whole image if there
/// are no outlines.
cv::Rect region(const marrow::View& view, const std::vector<Layer>& layers) {
  const cv::Rect whole = whole_image(view);
  double left = whole.width, right = 0, top = whole.height, bottom = 0;
  for (const Layer& layer : layers)
    for (const marrow::OutlinePoint& point : layer.outline) {
      left = std::min<double>(left, point.u_px), right = std::max<double>(right, point.u_px);
      top = std::min<double>(top, point.v_px), bottom = std::max<double>(bottom, point.v_px);
    }
  if (!(left < right) || !(top < bottom)) return whole;
  const double margin = 0.1 * std::max(right - left, bottom - top) + 4;
  const cv::Point from(int(left - margin), int(top - margin)), to(int(right + margin) + 1, int(bottom + margin) + 1);
  const cv::Rect part = cv::Rect(from, to) & whole;
  return part.empty() ? whole : part;
}

cv::Mat draw(const marrow::View& view, const std::string& title, const std::vector<Layer>& layers,
             const marrow::EdgeMap* edges, const marrow::ShaftLines* lines, const cv::Rect& part,
             const Options& options) {
  Panel panel = make_panel(view, part, options.size_px, contrast_of(options.contrast));
  if (edges) draw_edges(panel, *edges, kVermilion);
  if (lines)
    for (const marrow::LineSegment& line : {lines->left, lines->right}) draw_segment(panel, line, kGreen, 1);
  for (const Layer& layer : layers) draw_outline(panel, layer, options.contour_spacing_px);
  draw_title(panel, title);
  return panel.pixels;
}

marrow::Picture overlay(const marrow::Pose& pose, const marrow::OutlineProjector& projector, const marrow::View& view,
                        const marrow::Pose* start, const marrow::Truth* truth, const marrow::EdgeMap* edges,
                        const marrow::ShaftLines* lines, const Options& options) {
  marrow::check_view(view);
  std::vector<Layer> layers;
  const auto add = [&](const char* text, const cv::Scalar& colour, int thickness, const marrow::RigidTransform& at) {
    layers.push_back(make_layer(text, colour, thickness, projector, view, at, options));
  };
  if (truth) add("truth", kYellow, 4, truth->world_from_model);
  std::vector<Layer> after = layers;
  if (start) add("start", kOrange, 2, start->world_from_model);
  const std::vector<Layer> before = layers;
  add("result", kSkyBlue, 2, pose.world_from_model);

  std::vector<LegendItem> legend;
  for (const Layer& layer : layers) legend.push_back({layer.text, layer.colour});
  if (lines) legend.push_back({"shaft lines", kGreen});
  if (edges) legend.push_back({"edges", kVermilion});

  const cv::Rect part = options.zoom ? region(view, layers) : whole_image(view);
  after.push_back(layers.back());
  cv::Mat picture = draw(view, start ? view.name + ": after" : view.name, after, edges, lines, part, options);
  if (start) {
    const cv::Mat left = draw(view, view.name + ": before", before, edges, lines, part, options);
    cv::hconcat(left, picture.clone(), picture);
  }
  return {with_legend(picture, legend)};
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("render.overlay", overlay)
      .summary("The model's outline over an X-ray view, before and after registration")
      .in("pose", "pose found")
      .in("projector", "projector that gives the outline")
      .in("view", "X-ray view")
      .in("start", "pose before registration; adds a panel on the left")
      .in("truth", "exact pose; its outline is drawn wider, below the others")
      .in("edges", "edges of the view; drawn as faint dots")
      .in("lines", "borders of the shaft")
      .out("picture", "the view with outlines and a legend")
      .option("size_px", &Options::size_px, "longer side of a panel", marrow::at_least(64), marrow::at_most(8192))
      .option("contrast", &Options::contrast, "how grey values are shown",
              marrow::one_of({"local", "logarithmic", "linear"}))
      .option("contour_spacing_px", &Options::contour_spacing_px, "distance between two outline points",
              marrow::at_least(0.1), marrow::at_most(100))
      .option("zoom", &Options::zoom, "show only the part of the image around the outlines");
}
