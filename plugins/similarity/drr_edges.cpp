// SPDX-License-Identifier: Apache-2.0
// Edges of the radiograph against edges of the image: both are gradient maxima of something blurred, so both lie inside
// the bone's outline by about as much, where a surface's own outline does not (docs/method.md, Stage 2). Radiograph's
// edges against the image's: Gottesfeld Brown and Boult (MICCAI workshop 1996) and Penney et al. (IEEE Trans Med
// Imaging 1998) compare gradients; here the truncated distance of the contour cost is taken.
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "marrow/toolbox/match/edge_loss.hpp"
#include "marrow/toolbox/match/inputs.hpp"
#include "marrow/toolbox/match/nearest_edges.hpp"

namespace {

struct Options {
  int pixel_step = 2;
  double blur_px = 1.5;
  double threshold_percent = 15;
  double reach_px = 6;
  double scale_px = 1;
  double direction_tolerance_deg = 40;
  std::vector<double> weights;
};

/// An edge of the radiograph, as edge pixels are, with what it counts.
struct DrawnEdge {
  float u, v, direction_u, direction_v, weight;
};

/// Ridges of the gradient's magnitude, sub-pixel by a parabola across (Canny 1986; Devernay 1995). An edge counts the
/// more the steeper it is, from nothing at the threshold to 1 at twice of it, so that none appears or vanishes at once.
std::vector<DrawnEdge> edges_of(const cv::Mat& radiograph, const marrow::PixelGrid& grid, double threshold_percent) {
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
      // Neighbours one step across along the longer axis, between two pixels along the other.
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
      // Bone is where the integral is large, and brighter means less of it.
      edges.push_back({float(at.x()), float(at.y()), -x / here, -y / here, std::min(here / threshold - 1, 1.0f)});
    }
  return edges;
}

/// What does not depend on the level: made once, shared by all.
struct Scene {
  const marrow::RadiographProjector* projector;
  marrow::List<marrow::View> views;
  std::vector<marrow::match::NearestEdges> edges;
  Options options;
};

class DrrEdges : public marrow::Cost {
 public:
  DrrEdges(std::shared_ptr<const Scene> scene, int pixel_step, double reach_px)
      : scene_(std::move(scene)), step_(pixel_step), loss_(scene_->options.scale_px, reach_px) {}

  double value(const marrow::RigidTransform& world_from_model) const override {
    std::vector<double> of_view(scene_->views.size());
    tbb::parallel_for(std::size_t(0), of_view.size(),
                      [&](std::size_t i) { of_view[i] = value_in(i, world_from_model); });
    return marrow::match::weighted_mean(of_view, scene_->options.weights);
  }

  std::shared_ptr<const marrow::Cost> at_level(const marrow::CostLevel& level) const override {
    return std::make_shared<DrrEdges>(scene_, level.pixel_step > 0 ? level.pixel_step : step_, level.reach_px);
  }

 private:
  double value_in(std::size_t index, const marrow::RigidTransform& world_from_model) const {
    constexpr float kMargin_px = 3;  // edge detectors see nothing at the very border of an image
    const marrow::View& view = scene_->views[index];
    const marrow::Camera& camera = view.camera;
    const marrow::PixelGrid region = scene_->projector->region(camera, world_from_model);
    if (region.count() == 0) return loss_.worst();
    const double margin = std::ceil(4 * scene_->options.blur_px / step_) * step_;
    const marrow::PixelGrid grid{region.u_px - margin, region.v_px - margin, double(step_),
                                 int((region.columns + 2 * margin) / step_) + 1,
                                 int((region.rows + 2 * margin) / step_) + 1};
    std::vector<float> values = scene_->projector->radiograph(camera, world_from_model, grid);
    cv::Mat radiograph(grid.rows, grid.columns, CV_32F, values.data());
    // Steps and Sobel's operator smooth already.
    const double own2 = 0.5 * step_ * step_, blur2 = scene_->options.blur_px * scene_->options.blur_px - own2;
    if (const double blur = std::sqrt(std::max(blur2, 0.0)) / step_; blur > 0.2)
      cv::GaussianBlur(radiograph, radiograph, {}, blur);
    double sum = 0, weights = 0;
    for (const DrawnEdge& edge : edges_of(radiograph, grid, scene_->options.threshold_percent)) {
      if (edge.u < kMargin_px || edge.v < kMargin_px || edge.u > float(camera.width_px - 1) - kMargin_px ||
          edge.v > float(camera.height_px - 1) - kMargin_px)
        continue;
      if (!view.mask.empty() && !view.mask.at<std::uint8_t>(int(edge.v + 0.5f), int(edge.u + 0.5f))) continue;
      weights += double(edge.weight);
      sum += double(edge.weight) * loss_(distance2(index, edge));
    }
    // A view that shows hardly any is no evidence.
    const double least = 60.0 / step_;
    return (sum + std::max(0.0, least - weights) * loss_.worst()) / std::max(weights, least);
  }

  /// To the nearest edge of like direction: across the edge, and along it what goes beyond an edge pixel's own length.
  double distance2(std::size_t view, const DrawnEdge& edge) const {
    constexpr float kOwnLength_px = 1.5f;
    const marrow::EdgePixel* nearest = scene_->edges[view].find(edge.u, edge.v, edge.direction_u, edge.direction_v);
    if (!nearest) return 1e30;
    const float du = nearest->u_px - edge.u, dv = nearest->v_px - edge.v;
    const float across = du * edge.direction_u + dv * edge.direction_v,
                along = std::abs(dv * edge.direction_u - du * edge.direction_v);
    const float beyond = std::max(0.0f, along - kOwnLength_px);
    return double(across * across + beyond * beyond);
  }

  std::shared_ptr<const Scene> scene_;
  const int step_;
  const marrow::match::EdgeLoss loss_;
};

std::shared_ptr<const marrow::Cost> drr_edges(const marrow::RadiographProjector& projector,
                                              const marrow::List<marrow::View>& views,
                                              const marrow::List<marrow::EdgeMap>& edges,
                                              const marrow::OutlineProjector* outline,
                                              const marrow::List<marrow::Pose>* others,
                                              const marrow::List<marrow::OutlineProjector>* other_projectors,
                                              const Options& options) {
  marrow::match::check_edges(views, edges);
  marrow::match::check_weights(options.weights, views.size());
  const auto other = marrow::match::others_of(outline, others, other_projectors, "outline");
  const marrow::List<marrow::EdgeMap> own = marrow::match::without_outlines(
      views, edges, other, marrow::match::kOthersReach_px, options.direction_tolerance_deg);
  auto scene = std::make_shared<Scene>();
  scene->projector = &projector;
  scene->views = views;
  scene->options = options;
  for (std::size_t i = 0; i < views.size(); ++i)
    scene->edges.emplace_back(own[i], views[i].mask, marrow::radians(options.direction_tolerance_deg));
  return std::make_shared<DrrEdges>(std::move(scene), options.pixel_step, options.reach_px);
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("similarity.drr_edges", drr_edges)
      .summary(
          "Mean distance from the radiograph's edges to the image's nearest edges of like direction, both displaced "
          "alike by blur")
      .in("projector", "makes radiographs of the model")
      .in("views", "views with their cameras and masks", marrow::over("view"))
      .in("edges", "edge pixels of each view", marrow::over("view"))
      .in("outline", "draws this fragment's outline: tells it from the others")
      .in("others", "where other fragments are, whose edges are left out", marrow::over("fragment"))
      .in("other_projectors", "draw their outlines, and maybe this one", marrow::over("fragment"))
      .out("cost", "mean distance [px]")
      .option("pixel_step", &Options::pixel_step, "every how many pixels the radiograph is drawn", marrow::at_least(1),
              marrow::at_most(16))
      .option("blur_px", &Options::blur_px,
              "of the radiograph, as the edges' detector and the device blur the image: standard deviation",
              marrow::at_least(0), marrow::at_most(10))
      .option("threshold_percent", &Options::threshold_percent,
              "of the radiograph's steepest gradient, from which on there is an edge", marrow::at_least(0.1),
              marrow::at_most(90), marrow::unit("%"))
      .option("reach_px", &Options::reach_px, "distance from which on an edge counts as unmatched",
              marrow::at_least(0.5))
      .option("scale_px", &Options::scale_px, "distances below this count by their squares", marrow::at_least(0.01))
      .option("direction_tolerance_deg", &Options::direction_tolerance_deg,
              "by how much the directions of the edges may differ", marrow::at_least(10), marrow::at_most(180))
      .option("weights", &Options::weights, "of each view; none: all the same");
}
