// SPDX-License-Identifier: Apache-2.0
// Edges of the rendered radiograph (DRR) against edges of the image. Both are gradient maxima of a blurred image, so
// blur moves both inside the bone's outline by about the same distance. Blur does not move the outline of a surface
// (docs/method.md, Stage 2). Gottesfeld Brown and Boult (MICCAI workshop 1996) and Penney et al. (IEEE Trans Med
// Imaging 1998) compare the gradients of radiograph and image. Here the truncated distance of the contour cost is used.
#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "marrow/similarity/edge_loss.hpp"
#include "marrow/toolbox/match/nearest_edges.hpp"
#include "marrow/toolbox/match/views_cost.hpp"

namespace {

using namespace marrow;

struct Options {
  int pixel_step = 2;
  double blur_px = 1.5;
  double threshold_percent = 15;
  double reach_px = 6;
  double scale_px = 1;
  double direction_tolerance_deg = 40;
  std::vector<double> weights;
};

/// An edge pixel of the radiograph with its weight.
struct DrawnEdge {
  float u, v, direction_u, direction_v, weight;
};

/// Ridges of the gradient's magnitude. A parabola across the ridge gives the sub-pixel position (Canny 1986; Devernay
/// 1995). The weight rises from 0 at the threshold to 1 at twice the threshold, so that no edge appears or vanishes
/// suddenly.
std::vector<DrawnEdge> edges_of(const cv::Mat& radiograph, const PixelGrid& grid, double threshold_percent) {
  cv::Mat du, dv, magnitude;
  cv::Sobel(radiograph, du, CV_32F, 1, 0, 3, 0.125);
  cv::Sobel(radiograph, dv, CV_32F, 0, 1, 3, 0.125);
  cv::magnitude(du, dv, magnitude);
  double steepest = 0;
  cv::minMaxLoc(magnitude, nullptr, &steepest);
  std::vector<DrawnEdge> edges;
  const float threshold = float(0.01 * threshold_percent * steepest);
  if (!(threshold > 0)) return edges;
  for (int row = 1; row + 1 < magnitude.rows; ++row)
    for (int column = 1; column + 1 < magnitude.cols; ++column) {
      const float here = magnitude.at<float>(row, column);
      if (here <= threshold) continue;
      const float x = du.at<float>(row, column), y = dv.at<float>(row, column);
      // Neighbours across the ridge: one step along the axis of the larger component, interpolated along the other
      // axis.
      const bool level = std::abs(x) >= std::abs(y);
      const float slope = level ? y / x : x / y;
      const int side = slope >= 0 ? 1 : -1;
      const float share = std::abs(slope);
      const auto neighbour = [&](int sign) {
        const int r = level ? row : row + sign, c = level ? column + sign : column;
        const int r2 = level ? row + sign * side : r, c2 = level ? c : column + sign * side;
        return (1 - share) * magnitude.at<float>(r, c) + share * magnitude.at<float>(r2, c2);
      };
      const float before = neighbour(-1), after = neighbour(1);
      if (here < before || here <= after) continue;
      const float bend = before - 2 * here + after,
                  off = bend < 0 ? std::clamp(0.5f * (before - after) / bend, -0.5f, 0.5f) : 0;
      const float moved_u = level ? off : off * slope, moved_v = level ? off * slope : off;
      const Eigen::Vector2d at = grid.pixel(0, 0) + grid.step_px * Eigen::Vector2d(double(column) + double(moved_u),
                                                                                   double(row) + double(moved_v));
      // The direction of an edge points to the brighter side, where the line integral is smaller.
      edges.push_back({float(at.x()), float(at.y()), -x / here, -y / here, std::min(here / threshold - 1, 1.0f)});
    }
  return edges;
}

/// Data that does not depend on the level. It is made once and shared by all levels.
struct Scene {
  const RadiographProjector* projector;
  List<View> views;
  std::vector<match::NearestEdges> edges;
  Options options;
};

class DrrEdges : public match::ViewsCost {
 public:
  DrrEdges(std::shared_ptr<const Scene> scene, int pixel_step, double reach_px)
      : ViewsCost(scene->views.size(), scene->options.weights),
        scene_(std::move(scene)),
        step_(pixel_step),
        reach_px_(reach_px),
        loss_(scene_->options.scale_px, reach_px) {}

  double value_in_view(std::size_t view, const RigidTransform& world_from_model) const override {
    return value_of(sums(view, world_from_model).all());
  }

  std::shared_ptr<const Cost> at_level(const CostLevel& level) const override {
    return std::make_shared<DrrEdges>(scene_, level.pixel_step > 0 ? level.pixel_step : step_, level.reach_px);
  }

 private:
  std::string silence(std::size_t view, const RigidTransform& world_from_model) const override {
    return match::in_view(scene_->views, view, silence_of(view, world_from_model));
  }
  std::string silence_of(std::size_t view, const RigidTransform& world_from_model) const {
    const match::BlockSums::Sums found = sums(view, world_from_model).all();
    if (!(found.weights > 0))
      return scene_->views[view].mask.empty()
                 ? "it shows no edge of the radiograph, which is empty or outside the image"
                 : "no edge of the radiograph lies inside image and mask";
    const double gain = loss_.worst() - found.values / found.weights;
    if (gain > 1e-9 * loss_.worst()) return {};
    return formatted("no edge lies within {:.3g} px of the radiograph's edges", reach_px_);
  }

  /// A view that shows very few edges of the radiograph is no evidence.
  double value_of(const match::BlockSums::Sums& sums) const {
    const double least = 60.0 / step_;
    return (sums.values + std::max(0.0, least - sums.weights) * loss_.worst()) / std::max(sums.weights, least);
  }

  Split split(std::size_t view, const RigidTransform& world_from_model) const override {
    const match::BlockSums found = sums(view, world_from_model);
    return {value_of(found.all()), found.without_each([&](const auto& left) { return value_of(left); })};
  }

  /// The loss of each edge of the radiograph.
  match::BlockSums sums(std::size_t index, const RigidTransform& world_from_model) const {
    const View& view = scene_->views[index];
    const Camera& camera = view.camera;
    const PixelGrid region = scene_->projector->region(camera, world_from_model);
    match::BlockSums found(match::Blocks::of(camera));
    if (region.count() == 0) return found;
    const double margin = std::ceil(4 * scene_->options.blur_px / step_) * step_;
    const PixelGrid grid{region.u_px - margin, region.v_px - margin, double(step_),
                         int((region.columns + 2 * margin) / step_) + 1, int((region.rows + 2 * margin) / step_) + 1};
    std::vector<float> values = scene_->projector->radiograph(camera, world_from_model, grid);
    cv::Mat radiograph(grid.rows, grid.columns, CV_32F, values.data());
    // The pixel step and Sobel's operator already smooth the radiograph.
    const double own2 = 0.5 * step_ * step_, blur2 = scene_->options.blur_px * scene_->options.blur_px - own2;
    if (const double blur = std::sqrt(std::max(blur2, 0.0)) / step_; blur > 0.2)
      cv::GaussianBlur(radiograph, radiograph, {}, blur);
    for (const DrawnEdge& edge : edges_of(radiograph, grid, scene_->options.threshold_percent)) {
      if (!match::is_away_from_border(camera, edge.u, edge.v)) continue;
      if (match::is_masked(view, edge.u, edge.v)) continue;
      found.add(edge.u, edge.v, double(edge.weight) * loss_(distance2(index, edge)), double(edge.weight));
    }
    return found;
  }

  /// Squared distance to the nearest edge of similar direction. The distance along the edge counts only beyond the
  /// length that an edge pixel represents.
  double distance2(std::size_t view, const DrawnEdge& edge) const {
    const EdgePixel* nearest = scene_->edges[view].find(edge.u, edge.v, edge.direction_u, edge.direction_v);
    if (!nearest) return 1e30;
    const auto [across, beyond] =
        match::way_to_edge(nearest->u_px - edge.u, nearest->v_px - edge.v, edge.direction_u, edge.direction_v);
    return double(across * across + beyond * beyond);
  }

  std::shared_ptr<const Scene> scene_;
  const int step_;
  const double reach_px_;
  const match::EdgeLoss loss_;
};

std::shared_ptr<const Cost> drr_edges(const RadiographProjector& projector, const List<View>& views,
                                      const List<EdgeMap>& edges, const OutlineProjector* outline,
                                      const List<Pose>* others, const List<OutlineProjector>* other_projectors,
                                      const Options& options) {
  match::check_edges(views, edges);
  match::check_weights(options.weights, views.size());
  const auto other = match::others_of(outline, others, other_projectors, "outline");
  const List<EdgeMap> own =
      match::without_outlines(views, edges, other, match::kOthersReach_px, options.direction_tolerance_deg);
  auto scene = std::make_shared<Scene>();
  scene->projector = &projector;
  scene->views = views;
  scene->options = options;
  for (std::size_t i = 0; i < views.size(); ++i)
    scene->edges.emplace_back(own[i], views[i].mask, radians(options.direction_tolerance_deg));
  return std::make_shared<DrrEdges>(std::move(scene), options.pixel_step, options.reach_px);
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("similarity.drr_edges", drr_edges)
      .summary(
          "Mean distance from the edges of the radiograph (DRR) to the nearest edges of the image with similar "
          "direction; blur shifts both by the same distance")
      .in("projector", "makes radiographs of the model")
      .in("views", "views with their cameras and masks", over("view"))
      .in("edges", "edge pixels of each view", over("view"))
      .in("outline", "projector of this fragment's outline; it identifies this fragment in other_projectors")
      .in("others", "poses of other fragments; edges of these fragments are left out", over("fragment"))
      .in("other_projectors", "projectors of the other fragments' outlines; this fragment's own may be among them",
          over("fragment"))
      .out("cost", "mean distance [px]")
      .option("pixel_step", &Options::pixel_step, "the radiograph is computed at every n-th pixel", at_least(1),
              at_most(16))
      .option("blur_px", &Options::blur_px,
              "blur of the radiograph (standard deviation); should equal the blur of the edges by the X-ray device and "
              "the edge extractor",
              at_least(0), at_most(10))
      .option("threshold_percent", &Options::threshold_percent,
              "least gradient of an edge, as a percentage of the radiograph's steepest gradient", at_least(0.1),
              at_most(90), unit("%"))
      .option("reach_px", &Options::reach_px,
              "an edge of the radiograph with no edge of the image within this distance counts as unmatched",
              at_least(0.5))
      .option("scale_px", &Options::scale_px, "distances below about this count by their squares", at_least(0.01))
      .option("direction_tolerance_deg", &Options::direction_tolerance_deg,
              "largest angle between the directions of the edges", at_least(10), at_most(180))
      .option("weights", &Options::weights, "weight of each view; empty: all views have the same weight");
}
