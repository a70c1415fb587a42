// SPDX-License-Identifier: Apache-2.0
// Lavallee and Szeliski (IEEE Trans Pattern Anal Mach Intell 17(4), 1995): if the pose is right, the ray from the
// source through an edge of the image touches the surface. So the signed distance has a minimum of 0 along the ray
// (their section 3). No outline is needed.
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "marrow/similarity/block_expansions.hpp"
#include "surface_distance.hpp"

namespace {

using namespace marrow;

struct Options {
  double reach_mm = 4;
  double direction_tolerance_deg = 40;
  double edge_offset_mm = 0;
  int ray_step = 2;
  std::vector<double> weights;
};

/// The ray of an edge pixel in the camera's frame, and the direction of the edge in the image.
struct Ray {
  float u_px, v_px;
  Eigen::Vector3d direction;
  Eigen::Vector2d towards_brighter;
};

/// Tukey's biweight: d^2 / 2 near 0, constant beyond the reach (Huber 1981, 4.8).
struct Loss {
  double reach;
  double worst() const { return reach * reach / 6; }
  double operator()(double d) const { return worst() * (1 - std::pow(1 - share(d), 3)); }
  /// Derivative with respect to the distance, divided by the distance.
  double weight(double d) const { return std::pow(1 - share(d), 2); }
  /// Second derivative.
  double curvature(double d) const { return (1 - share(d)) * (1 - 5 * share(d)); }
  double share(double d) const { return std::min(1.0, d * d / (reach * reach)); }
};

/// The information of one ray about a pose.
struct Touch {
  double distance_mm = 0;
  double like = 0;                ///< from 0 to 1: how well the edge's direction fits the surface there
  Eigen::Vector3d point, normal;  ///< both in the model's frame
};

class RayToSurface : public match::ViewsCost {
 public:
  struct Scene {
    List<View> views;
    std::vector<std::vector<Ray>> rays;
    match::SurfaceDistance distance;
    Options options;
  };
  RayToSurface(std::shared_ptr<const Scene> scene, int step, double reach_mm)
      : ViewsCost(scene->views.size(), scene->options.weights),
        scene_(std::move(scene)),
        step_(std::size_t(step)),
        loss_{std::min(reach_mm, double(scene_->distance.most_mm()))} {}

  double value_in_view(std::size_t view, const RigidTransform& world_from_model) const override {
    return value_of(sums(view, world_from_model).all());
  }

  /// The derivative of the least distance along a ray. The shift of the touching point along the ray can be ignored,
  /// because it has no effect to first order. The change of `like` with the pose is neglected.
  std::optional<Expansion> expansion(const RigidTransform& world_from_model,
                                     const FragmentFrame& frame) const override {
    Expansion about;
    double weights = 0;
    for (std::size_t i = 0; i < scene_->views.size(); ++i) weights += match::weight_of(scene_->options.weights, i);
    for (std::size_t i = 0; i < scene_->views.size(); ++i) {
      const auto touches = touches_of(i, world_from_model);
      const double share = match::weight_of(scene_->options.weights, i) / weights;
      about.value += share * loss_.worst();
      for (const auto& touch : touches) {
        if (!touch) continue;
        const double one = share / double(touches.size()) * touch->like;
        const Vector6d slope = slope_of(*touch, frame);
        const double weight = loss_.weight(touch->distance_mm);
        about.value += one * (loss_(touch->distance_mm) - loss_.worst());
        about.gradient += one * weight * touch->distance_mm * slope;
        about.curvature += one * weight * slope * slope.transpose();
      }
    }
    return about;
  }

  /// A distance that all edges have in common is one more unknown. Blur moves all edges inwards. This pulls opposite
  /// borders to opposite sides, so it hardly moves the pose, but each block alone shows it. Five blocks along an image,
  /// as for the contour. A single view gives no blocks: its least cost lies centimetres away from the bone along the
  /// rays.
  std::vector<Expansion> expansion_without_each_block(const RigidTransform& world_from_model,
                                                      const FragmentFrame& frame) const override {
    constexpr int kBlocksAlong = 5;
    if (scene_->views.size() < 2) return {};
    std::vector<std::vector<std::optional<Touch>>> views;
    std::vector<double> weights;
    for (std::size_t i = 0; i < scene_->views.size(); ++i) {
      views.push_back(touches_of(i, world_from_model));
      weights.push_back(match::weight_of(scene_->options.weights, i));
    }
    const double common_mm = common_distance_mm(views, weights);
    std::vector<match::BlockExpansions> of_views;
    for (std::size_t i = 0; i < views.size(); ++i) {
      match::BlockExpansions& sums = of_views.emplace_back(match::Blocks::of(scene_->views[i].camera, kBlocksAlong));
      for (std::size_t k = 0; k < views[i].size(); ++k) {
        const Ray& ray = scene_->rays[i][k * step_];
        sums.count(ray.u_px, ray.v_px);
        const std::optional<Touch>& touch = views[i][k];
        if (!touch) continue;
        const double left_mm = touch->distance_mm - common_mm;
        sums.add(ray.u_px, ray.v_px, slope_of(*touch, frame), touch->like * loss_.weight(left_mm) * left_mm,
                 touch->like * loss_.curvature(left_mm));
      }
    }
    std::vector<Expansion> without = match::BlockExpansions::without_each(of_views, weights, 1, true);
    // The pose has the least cost without this unknown, so what all blocks have in common is the cost's own slope.
    // Where noise hides some edges, a pull of the others remains, which the common distance hides. kMore covers this
    // pull, as measured (docs/results-trust.md, Deviations and noise).
    constexpr double kMore = 1.3;
    const Vector6d whole = expansion(world_from_model, frame)->gradient;
    Vector6d mean = Vector6d::Zero();
    for (const Expansion& one : without) mean += one.gradient / double(without.size());
    for (Expansion& one : without) one.gradient = whole + kMore * (one.gradient - mean);
    return without;
  }

  /// Uses every n-th edge pixel, with n from the contour spacing. The reach is converted to mm where the views meet. If
  /// they do not meet, reach_mm is the reach of a usual level, and other levels have theirs in proportion.
  std::shared_ptr<const Cost> at_level(const CostLevel& level) const override {
    const std::optional<Eigen::Vector3d> bone_mm = meeting_point_mm(scene_->views);
    const double reach_mm = bone_mm ? level.reach_px * pixel_size_at_mm(scene_->views[0].camera, *bone_mm)
                                    : level.reach_px / CostLevel().reach_px * scene_->options.reach_mm;
    return std::make_shared<RayToSurface>(scene_, std::max(1, int(std::lround(level.contour_spacing_px))), reach_mm);
  }

 private:
  std::string silence(std::size_t view, const RigidTransform& world_from_model) const override {
    return match::in_view(scene_->views, view, silence_of(view, world_from_model));
  }
  std::string silence_of(std::size_t view, const RigidTransform& world_from_model) const {
    if (scene_->rays[view].empty()) return "it has no edge that is inside the mask and belongs to this bone";
    const auto touches = touches_of(view, world_from_model);
    if (std::any_of(touches.begin(), touches.end(), [](const auto& touch) { return touch.has_value(); })) return {};
    return formatted("no ray through an edge passes within {:.3g} mm of the model's surface", loss_.reach);
  }

  /// How the distance changes with a small motion of the model: by (r, t) the ray moves relative to the model by
  /// -(r x (p - o) + t), in the fragment's axes.
  static Vector6d slope_of(const Touch& touch, const FragmentFrame& frame) {
    const Eigen::Vector3d normal = frame.axes.transpose() * touch.normal,
                          arm = frame.axes.transpose() * (touch.point - frame.origin_mm);
    Vector6d slope;
    slope << -arm.cross(normal), -normal;
    return slope;
  }

  /// The distance of least cost, by iteratively reweighted means.
  double common_distance_mm(const std::vector<std::vector<std::optional<Touch>>>& views,
                            const std::vector<double>& weights) const {
    constexpr int kRounds = 5;
    double common_mm = 0;
    for (int round = 0; round < kRounds; ++round) {
      double sum = 0, total = 0;
      for (std::size_t i = 0; i < views.size(); ++i)
        for (const std::optional<Touch>& touch : views[i]) {
          if (!touch) continue;
          const double weight =
              weights[i] / double(views[i].size()) * touch->like * loss_.weight(touch->distance_mm - common_mm);
          sum += weight * touch->distance_mm;
          total += weight;
        }
      if (!(total > 0)) break;
      common_mm = sum / total;
    }
    return common_mm;
  }

  double value_of(const match::BlockSums::Sums& sums) const {
    return loss_.worst() + (sums.weights > 0 ? sums.values / sums.weights : 0);
  }

  /// No deviations are predicted from values: the distance that all edges have in common must be removed first.
  std::vector<double> without_each_block(const RigidTransform&) const override { return {}; }

  Split split(std::size_t view, const RigidTransform& world_from_model) const override {
    const match::BlockSums found = sums(view, world_from_model);
    return {value_of(found.all()), found.without_each([&](const auto& left) { return value_of(left); })};
  }

  /// The loss of each ray, less the worst.
  match::BlockSums sums(std::size_t view, const RigidTransform& world_from_model) const {
    match::BlockSums found(match::Blocks::of(scene_->views[view].camera));
    const auto touches = touches_of(view, world_from_model);
    for (std::size_t i = 0; i < touches.size(); ++i) {
      const Ray& ray = scene_->rays[view][i * step_];
      const auto& touch = touches[i];
      found.add(ray.u_px, ray.v_px, touch ? touch->like * (loss_(touch->distance_mm) - loss_.worst()) : 0, 1);
    }
    return found;
  }

  std::vector<std::optional<Touch>> touches_of(std::size_t view, const RigidTransform& world_from_model) const {
    const std::vector<Ray>& rays = scene_->rays[view];
    std::vector<std::optional<Touch>> touches((rays.size() + step_ - 1) / step_);
    const RigidTransform model_from_camera =
        inverse(world_from_model) * inverse(scene_->views[view].camera.camera_from_world);
    const Eigen::Matrix3d line_from_normal =
        scene_->views[view].camera.intrinsics.inverse().transpose() * model_from_camera.rotation.transpose();
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, touches.size(), 64),
                      [&](const tbb::blocked_range<std::size_t>& range) {
                        for (std::size_t i = range.begin(); i < range.end(); ++i)
                          touches[i] = touch_of(rays[i * step_], model_from_camera, line_from_normal);
                      });
    return touches;
  }

  /// Of all local minima of the distance along the ray, the one that explains the edge best. A ray can have several,
  /// because X-ray images also show inner outlines: the ray touches the surface there and runs through the bone
  /// elsewhere. Nothing if the ray passes too far from the surface.
  std::optional<Touch> touch_of(const Ray& ray, const RigidTransform& model_from_camera,
                                const Eigen::Matrix3d& line_from_normal) const {
    const match::SurfaceDistance& distance = scene_->distance;
    const Grid& grid = distance.grid();
    const Eigen::Vector3d start = grid.index_from_point(model_from_camera.translation_mm);
    const Eigen::Vector3d along = model_from_camera.rotation * ray.direction;  // of length 1 mm
    const Eigen::Vector3d direction = (grid.direction.transpose() * along).cwiseQuotient(grid.spacing_mm);
    const auto [from, to] = distance.span(start, direction);
    const double finest_mm = 0.5 * grid.spacing_mm.minCoeff(), offset = scene_->options.edge_offset_mm;
    std::optional<Touch> best;
    double least = loss_.worst(), before = 1e30, here = 1e30, at = from;
    // A distance changes by at most 1 mm per mm, so these steps do not miss a place within reach.
    for (double t = from; t < to;) {
      const double after = distance.at(start + t * direction);
      if (here < before && here <= after && std::abs(here - offset) < loss_.reach) {
        const Touch touch =
            touch_at(ray, start, direction, std::clamp(at + vertex(before, here, after) * finest_mm, from, to - 1e-9),
                     line_from_normal);
        if (const double cost = loss_.worst() + touch.like * (loss_(touch.distance_mm) - loss_.worst()); cost < least)
          least = cost, best = touch;
      }
      before = here, here = after, at = t;
      t += std::max(finest_mm, std::abs(after - offset) - loss_.reach);
    }
    return best;
  }

  Touch touch_at(const Ray& ray, const Eigen::Vector3d& start, const Eigen::Vector3d& direction, double at,
                 const Eigen::Matrix3d& line_from_normal) const {
    const Eigen::Vector3d index = start + at * direction;
    Touch touch;
    touch.distance_mm = double(scene_->distance.at(index)) - scene_->options.edge_offset_mm;
    touch.point = scene_->distance.grid().point_from_index(index);
    touch.normal = scene_->distance.gradient(index);
    touch.like = likeness(line_from_normal * touch.normal, ray);
    return touch;
  }

  /// Position of the minimum of the parabola through three distances, in steps from the middle one.
  static double vertex(double before, double here, double after) {
    const double bend = before - 2 * here + after;
    return bend > 1e-9 && bend < 1e9 ? std::clamp(0.5 * (before - after) / bend, -1.0, 1.0) : 0;
  }

  /// 1 if the projected normal of the surface points to the brighter side of the edge; 0 if it deviates by the
  /// tolerance or more.
  double likeness(const Eigen::Vector3d& line, const Ray& ray) const {
    const double length = line.head<2>().norm();
    if (!(length > 0)) return 0;
    const double least = std::cos(radians(scene_->options.direction_tolerance_deg));
    const double share =
        std::clamp((line.head<2>().dot(ray.towards_brighter) / length - least) / (0.5 * (1 - least)), 0.0, 1.0);
    return share * share * (3 - 2 * share);
  }

  std::shared_ptr<const Scene> scene_;
  const std::size_t step_;
  const Loss loss_;
};

std::vector<Ray> rays_of(const View& view, const EdgeMap& edges) {
  const Eigen::Matrix3d ray_from_pixel = view.camera.intrinsics.inverse();
  std::vector<Ray> rays;
  for (const EdgePixel& edge : edges.pixels) {
    const int u = int(std::lround(edge.u_px)), v = int(std::lround(edge.v_px));
    const bool is_inside = u >= 0 && v >= 0 && u < edges.width_px && v < edges.height_px;
    if (!is_inside || (!view.mask.empty() && !view.mask.at<std::uint8_t>(v, u))) continue;
    rays.push_back({edge.u_px,
                    edge.v_px,
                    (ray_from_pixel * Eigen::Vector3d(edge.u_px, edge.v_px, 1)).normalized(),
                    {edge.direction_u, edge.direction_v}});
  }
  return rays;
}

std::shared_ptr<const Cost> ray_to_surface(const SignedField& field, const List<View>& views,
                                           const List<EdgeMap>& edges, const OutlineProjector* projector,
                                           const List<Pose>* others, const List<OutlineProjector>* other_projectors,
                                           const Options& options) {
  match::check_edges(views, edges);
  match::check_weights(options.weights, views.size());
  if (field.values_mm.size() != field.grid.count() ||
      *std::min_element(field.grid.size.begin(), field.grid.size.end()) < 2)
    throw Error(
        "the field is empty or broken: it needs 2 x 2 x 2 voxels at least and a value for each; wire that of a "
        "segmented fragment");
  if (*std::min_element(field.values_mm.begin(), field.values_mm.end()) >= 0)
    throw Error("the field has no inside, so no ray can touch its surface; check the segmentation");
  const List<EdgeMap> own = match::without_outlines(views, edges, match::others_of(projector, others, other_projectors),
                                                    match::kOthersReach_px, options.direction_tolerance_deg);
  auto scene =
      std::make_shared<RayToSurface::Scene>(RayToSurface::Scene{views, {}, match::SurfaceDistance(field), options});
  for (std::size_t i = 0; i < views.size(); ++i) scene->rays.push_back(rays_of(views[i], own[i]));
  return std::make_shared<RayToSurface>(std::move(scene), options.ray_step, options.reach_mm);
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("similarity.ray_to_surface", ray_to_surface)
      .summary(
          "Distance between the rays through the images' edges and the surface (Lavallee and Szeliski, IEEE PAMI "
          "1995), with derivatives")
      .trait("derivatives")
      .in("field", "signed distance to the surface")
      .in("views", "views with their cameras and masks", over("view"))
      .in("edges", "edge pixels of each view", over("view"))
      .in("projector", "projector of this fragment's outline; it identifies this fragment in other_projectors")
      .in("others", "poses of other fragments; edges of these fragments are left out", over("fragment"))
      .in("other_projectors", "projectors of the other fragments' outlines; this fragment's own may be among them",
          over("fragment"))
      .out("cost", "mean of Tukey's biweight of the distances [mm^2]")
      .option("reach_mm", &Options::reach_mm,
              "rays farther from the surface than this belong to something else; limited by the field's largest value. "
              "In a search the level's reach_px counts, in mm where the views meet; with views that do not meet, such "
              "as a single one, reach_mm is the reach at 8 px, and other levels have theirs in proportion",
              at_least(0.1))
      .option("direction_tolerance_deg", &Options::direction_tolerance_deg,
              "largest angle between the directions of edge and surface", at_least(10), at_most(180))
      .option("edge_offset_mm", &Options::edge_offset_mm, "distance of the edges outside the surface; negative: inside")
      .option("ray_step", &Options::ray_step, "every n-th edge pixel is used", at_least(1), at_most(100))
      .option("weights", &Options::weights, "weight of each view; empty: all views have the same weight");
}
