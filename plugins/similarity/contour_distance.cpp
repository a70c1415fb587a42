// SPDX-License-Identifier: Apache-2.0
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "contour_matches.hpp"
#include "marrow/similarity/block_expansions.hpp"
#include "marrow/similarity/blur.hpp"

namespace {

using namespace marrow;

using match::in_view, match::weight_of;
using match::kMostOffset_px, match::Matches, match::Residual;
using Options = match::ContourOptions;

/// Data that does not depend on the level. It is made once and shared by all levels.
struct Scene {
  const OutlineProjector* projector;
  List<View> views;
  std::vector<match::NearestEdges> edges;
  Options options;
};

class ContourDistance : public match::ViewsCost {
 public:
  ContourDistance(std::shared_ptr<const Scene> scene, CostLevel level)
      : ViewsCost(scene->views.size(), scene->options.weights),
        scene_(std::move(scene)),
        level_(level),
        loss_(scene_->options.scale_px, level.reach_px) {}

  /// With the offset that is best for this view alone.
  double value_in_view(std::size_t view, const RigidTransform& world_from_model) const override {
    const std::vector<Matches> matches{match(view, world_from_model)};
    return value_of(matches[0], offset_of(matches));
  }

  /// Gauss-Newton with the weights of the loss. Each point keeps its edge and its normal and moves along this normal.
  /// The edge offset is one more unknown, which is eliminated.
  std::optional<Expansion> expansion(const RigidTransform& world_from_model,
                                     const FragmentFrame& frame) const override {
    const std::vector<Matches> views = match(world_from_model);
    const double offset = offset_of(views);
    Expansion about;
    about.value = mean_of(values_of(views, offset));
    Vector6d mixed = Vector6d::Zero();
    double weights = 0, of_all = 0;
    for (std::size_t i = 0; i < views.size(); ++i) of_all += weight_of(scene_->options.weights, i);
    for (std::size_t i = 0; i < views.size(); ++i) {
      const RigidTransform camera_from_model = scene_->views[i].camera.camera_from_world * world_from_model;
      const double of_view = weight_of(scene_->options.weights, i) / of_all,
                   points = std::max(double(views[i].points()), least_points());
      const auto add = [&](const std::vector<Residual>& residuals, double of_each) {
        for (const Residual& r : residuals) {
          const double weight = of_each * loss_.weight(distance2(r, offset));
          if (weight == 0) continue;
          const Vector6d slope = -outward_motion_px(r, scene_->views[i].camera, camera_from_model, frame);
          about.gradient += weight * (double(r.along_normal) - offset) * slope;
          about.curvature.selfadjointView<Eigen::Lower>().rankUpdate(slope, weight);
          mixed += weight * slope;
          weights += weight;
        }
      };
      const double half = scene_->options.symmetric ? 0.5 : 1;
      add(views[i].residuals, half * of_view / points);
      if (scene_->options.symmetric && backward(views[i], offset) > 0)
        add(views[i].of_edges, half * of_view / (points * level_.contour_spacing_px));
    }
    if (scene_->options.estimate_offset && weights > 0)
      about.curvature.selfadjointView<Eigen::Lower>().rankUpdate(mixed, -1 / weights);
    about.curvature = about.curvature.selfadjointView<Eigen::Lower>();
    return about;
  }

  /// Each point keeps its edge. The curvature is that of the loss, which far from 0 is less than in expansion(). Five
  /// blocks along an image: on a border, errors are alike over 20 to 40 mm of the bone. Ten if there is one view: the
  /// few larger blocks that show the border would hardly be more than the seven unknowns.
  std::vector<Expansion> expansion_without_each_block(const RigidTransform& world_from_model,
                                                      const FragmentFrame& frame) const override {
    const int blocks_along = scene_->views.size() > 1 ? 5 : 10;
    const bool symmetric = scene_->options.symmetric;
    const std::vector<Matches> views = match(world_from_model);
    const double offset = offset_of(views);
    std::vector<match::BlockExpansions> of_views;
    std::vector<double> weights;
    for (std::size_t i = 0; i < views.size(); ++i) {
      const Camera& camera = scene_->views[i].camera;
      const RigidTransform camera_from_model = camera.camera_from_world * world_from_model;
      match::BlockExpansions sums(match::Blocks::of(camera, blocks_along));
      const auto add = [&](const std::vector<Residual>& residuals, double of_each) {
        for (const Residual& r : residuals) {
          const double across = double(r.along_normal) - offset, square = distance2(r, offset);
          sums.add(r.u, r.v, -outward_motion_px(r, camera, camera_from_model, frame),
                   of_each * loss_.weight(square) * across, of_each * loss_.curvature(square, across * across));
        }
      };
      add(views[i].residuals, symmetric ? 0.5 : 1);
      if (symmetric && backward(views[i], offset) > 0) add(views[i].of_edges, 0.5 / level_.contour_spacing_px);
      for (const Residual& r : views[i].residuals) sums.count(r.u, r.v);
      for (const Eigen::Vector2f& at : views[i].unmatched_px) sums.count(at.x(), at.y());
      of_views.push_back(std::move(sums));
      weights.push_back(weight_of(scene_->options.weights, i));
    }
    return match::BlockExpansions::without_each(of_views, weights, least_points(), scene_->options.estimate_offset);
  }

  std::shared_ptr<const Cost> at_level(const CostLevel& level) const override {
    return std::make_shared<ContourDistance>(scene_, level);
  }

 private:
  std::string silence(std::size_t view, const RigidTransform& world_from_model) const override {
    return in_view(scene_->views, view, silence_of(view, world_from_model));
  }
  std::string silence_of(std::size_t view, const RigidTransform& world_from_model) const {
    const std::vector<Matches> views = match(world_from_model);
    const Matches& matches = views[view];
    if (matches.points() == 0)
      return matches.is_drawn ? "the mask hides the whole outline of the model"
                              : "it shows nothing of the model's outline, which is empty or outside the image";
    const double offset = offset_of(views);
    const auto matters = [&](const Residual& r) { return loss_.weight(distance2(r, offset)) > 0; };
    if (std::any_of(matches.residuals.begin(), matches.residuals.end(), matters) ||
        std::any_of(matches.of_edges.begin(), matches.of_edges.end(), matters))
      return {};
    return formatted("no edge lies within {:.3g} px of the model's outline", level_.reach_px);
  }

  /// If a view has fewer points than this, the missing ones count as unmatched.
  double least_points() const { return 60 / level_.contour_spacing_px; }

  double value_of(const Matches& view, double offset) const {
    return scene_->options.symmetric ? 0.5 * (forward(view, offset) + backward(view, offset)) : forward(view, offset);
  }
  std::vector<double> values_of(const std::vector<Matches>& views, double offset) const {
    std::vector<double> values;
    for (const Matches& view : views) values.push_back(value_of(view, offset));
    return values;
  }

  std::vector<double> values_of_views(const RigidTransform& world_from_model) const override {
    const std::vector<Matches> views = match(world_from_model);
    return values_of(views, offset_of(views));
  }

  Split split(std::size_t view, const RigidTransform& world_from_model) const override {
    return splits(world_from_model)[view];
  }
  std::vector<Split> splits(const RigidTransform& world_from_model) const override {
    const std::vector<Matches> views = match(world_from_model);
    const double offset = offset_of(views);
    std::vector<Split> splits;
    for (std::size_t i = 0; i < views.size(); ++i) {
      const auto blocks = match::Blocks::of(scene_->views[i].camera);
      Split split{value_of(views[i], offset),
                  forward_sums(views[i], offset, blocks).without_each([&](const auto& sums) { return forward(sums); })};
      if (scene_->options.symmetric) {
        const std::vector<double> back =
            backward_sums(views[i], offset, blocks).without_each([&](const auto& sums) { return backward(sums); });
        for (std::size_t k = 0; k < back.size(); ++k) split.without_block[k] = 0.5 * (split.without_block[k] + back[k]);
      }
      splits.push_back(std::move(split));
    }
    return splits;
  }

  /// Derivative of a point's motion along its normal in the image, with respect to the six parameters of the motion.
  static Vector6d outward_motion_px(const Residual& r, const Camera& camera, const RigidTransform& camera_from_model,
                                    const FragmentFrame& frame) {
    const Eigen::Vector3d point = r.model_mm.cast<double>(), seen = camera_from_model * point;
    const Eigen::RowVector3d by_camera =
        (double(r.normal_u) * (camera.intrinsics.row(0) - double(r.u) * camera.intrinsics.row(2)) +
         double(r.normal_v) * (camera.intrinsics.row(1) - double(r.v) * camera.intrinsics.row(2))) /
        seen.z();
    const Eigen::Vector3d by_point = (by_camera * camera_from_model.rotation).transpose();
    Vector6d motion;
    motion << frame.axes.transpose() * (point - frame.origin_mm).cross(by_point), frame.axes.transpose() * by_point;
    return motion;
  }

  using Sums = match::BlockSums::Sums;
  match::BlockSums forward_sums(const Matches& view, double offset, const match::Blocks& blocks) const {
    match::BlockSums sums(blocks);
    for (const Residual& r : view.residuals) sums.add(r.u, r.v, loss_(distance2(r, offset)), 1);
    for (const Eigen::Vector2f& at : view.unmatched_px) sums.add(at.x(), at.y(), loss_.worst(), 1);
    return sums;
  }
  /// Gains of the edges near the outline, and the outline's points.
  match::BlockSums backward_sums(const Matches& view, double offset, const match::Blocks& blocks) const {
    match::BlockSums sums(blocks);
    for (const Residual& r : view.of_edges) sums.add(r.u, r.v, loss_.worst() - loss_(distance2(r, offset)), 0);
    for (const Residual& r : view.residuals) sums.add(r.u, r.v, 0, 1);
    for (const Eigen::Vector2f& at : view.unmatched_px) sums.add(at.x(), at.y(), 0, 1);
    return sums;
  }

  /// The mean loss over the points of the outline. Parts of the outline outside the image cost nothing. But a view that
  /// shows very little of the outline is no evidence.
  double forward(const Sums& sums) const {
    const double points = std::max(sums.weights, least_points());
    return (sums.values + (points - sums.weights) * loss_.worst()) / points;
  }
  double forward(const Matches& view, double offset) const {
    Sums sums{0, double(view.points())};
    for (const Residual& r : view.residuals) sums.values += loss_(distance2(r, offset));
    sums.values += double(view.unmatched_px.size()) * loss_.worst();
    return forward(sums);
  }

  /// The same in the other direction, from the edges to the outline: the worst loss minus the gain of each edge near
  /// the outline, divided by the length of the outline in pixels. (A perfect image has one edge for each of these
  /// pixels.) Edges farther away belong to something else and do not count.
  double backward(const Sums& sums) const {
    const double length_px = level_.contour_spacing_px * std::max(sums.weights, least_points());
    return std::max(0.0, loss_.worst() - sums.values / length_px);
  }
  double backward(const Matches& view, double offset) const {
    Sums sums{0, double(view.points())};
    for (const Residual& r : view.of_edges) sums.values += loss_.worst() - loss_(distance2(r, offset));
    return backward(sums);
  }

  static double distance2(const Residual& r, double offset) {
    const double across = double(r.along_normal) - offset;
    return across * across + double(r.beyond) * double(r.beyond);
  }

  std::vector<Matches> match(const RigidTransform& world_from_model) const {
    std::vector<Matches> views(scene_->views.size());
    tbb::parallel_for(std::size_t(0), views.size(), [&](std::size_t i) { views[i] = match(i, world_from_model); });
    return views;
  }

  Matches match(std::size_t index, const RigidTransform& world_from_model) const {
    const View& view = scene_->views[index];
    return matches_of(view, scene_->edges[index],
                      scene_->projector->outline(view.camera, world_from_model, level_.contour_spacing_px),
                      level_.reach_px, scene_->options);
  }

  /// Distance of the images' edges outside the model's outline, the same in all views. It is needed because X-ray edges
  /// of a round bone lie inside its silhouette, and a segmented model may be too thick or too thin. It is the value
  /// with the least cost at this pose, by iteratively reweighted means.
  double offset_of(const std::vector<Matches>& views) const {
    constexpr int kRounds = 5;
    double offset = scene_->options.edge_offset_px;
    if (!scene_->options.estimate_offset) return offset;
    const double low = offset - kMostOffset_px, high = offset + kMostOffset_px;
    for (int round = 0; round < kRounds; ++round) {
      double sum = 0, weights = 0;
      for (std::size_t i = 0; i < views.size(); ++i) {
        const Matches& view = views[i];
        const double of_view = weight_of(scene_->options.weights, i) / std::max(double(view.points()), least_points());
        for (const Residual& r : view.residuals) {
          const double weight = of_view * loss_.weight(distance2(r, offset));
          sum += weight * double(r.along_normal);
          weights += weight;
        }
      }
      if (weights <= 0) break;
      offset = std::clamp(sum / weights, low, high);
    }
    return offset;
  }

  std::shared_ptr<const Scene> scene_;
  const CostLevel level_;
  const match::EdgeLoss loss_;
};

/// By how much the images' blur moves the edges of a round bone inwards, the mean over the views.
double edges_inside_px(const List<View>& views, const List<EdgeMap>& edges) {
  double sum = 0;
  for (std::size_t i = 0; i < views.size(); ++i)
    sum += image::border_inside_px(image::blur_px(views[i].image.pixels, edges[i]));
  return sum / double(views.size());
}

std::shared_ptr<const Cost> contour_distance(const OutlineProjector& projector, const List<View>& views,
                                             const List<EdgeMap>& edges, const List<Pose>* others,
                                             const List<OutlineProjector>* other_projectors, const Options& options) {
  match::check_edges(views, edges);
  match::check_weights(options.weights, views.size());
  const auto other = match::others_of(&projector, others, other_projectors);
  const List<EdgeMap> own =
      match::without_outlines(views, edges, other, options.others_reach_px, options.direction_tolerance_deg);
  auto scene = std::make_shared<Scene>();
  scene->projector = &projector;
  scene->views = views;
  scene->options = options;
  if (options.estimate_offset && options.x_ray) scene->options.edge_offset_px -= edges_inside_px(views, edges);
  for (std::size_t i = 0; i < views.size(); ++i) {
    scene->edges.emplace_back(own[i], views[i].mask, radians(options.direction_tolerance_deg));
    if (scene->edges.back().empty())
      throw Error("view '" + views.name(i) +
                  (other.empty() ? "': no edge lies inside the mask; widen the mask"
                                 : "': no edge lies inside the mask that is not another fragment's; widen the mask, or "
                                   "give a smaller others_reach_px"));
  }
  return std::make_shared<ContourDistance>(std::move(scene), CostLevel{options.contour_spacing_px, options.reach_px});
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("similarity.contour_distance", contour_distance)
      .summary(
          "Mean distance from the points of the projected outline to the nearest edges of similar direction, over all "
          "views")
      .trait("derivatives")
      .in("projector", "projector that gives the outline of the model")
      .in("views", "views with their cameras and masks", over("view"))
      .in("edges", "edge pixels of each view", over("view"))
      .in("others", "poses of other fragments; edges of these fragments are left out", over("fragment"))
      .in("other_projectors", "projectors of the other fragments' outlines; this fragment's own may be among them",
          over("fragment"))
      .out("cost", "mean distance [px]")
      .option("contour_spacing_px", &Options::contour_spacing_px, "distance between two points of the outline",
              at_least(0.25))
      .option("reach_px", &Options::reach_px, "a point with no edge within this distance counts as unmatched",
              at_least(0.5))
      .option("scale_px", &Options::scale_px, "distances below about this count by their squares", at_least(0.01))
      .option("direction_tolerance_deg", &Options::direction_tolerance_deg,
              "largest angle between the directions of edge and outline", at_least(10), at_most(180))
      .option("polarity", &Options::polarity,
              "brighter_outside: edges count where the image is brighter outside the model, as in X-ray images; "
              "either: where it is darker, too, as in photographs",
              one_of({"brighter_outside", "either"}))
      .option(
          "edge_offset_px", &Options::edge_offset_px,
          "distance of the edges outside the model's outline; if estimate_offset and x_ray are set, in addition to the "
          "distance that the image's blur makes; with estimate_offset, the middle of the range of +-3 px that is tried")
      .option("estimate_offset", &Options::estimate_offset,
              "find the best edge offset at each pose; it is the same in all views")
      .option("x_ray", &Options::x_ray,
              "with estimate_offset: blur moves edges inwards, as in X-ray images of a round bone; false: it moves "
              "them to no side, as in photographs")
      .option("symmetric", &Options::symmetric,
              "half of the cost comes from the distances in the other direction, from the edges near the outline to "
              "the outline")
      .option("others_reach_px", &Options::others_reach_px,
              "edges within this distance of another fragment's outline belong to that fragment", at_least(0),
              at_most(50))
      .option("weights", &Options::weights, "weight of each view; empty: all views have the same weight");
}
