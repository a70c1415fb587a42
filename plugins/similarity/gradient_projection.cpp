// SPDX-License-Identifier: Apache-2.0
// Compares gradients of the images, back-projected to the surface, with gradients of the CT (Tomazevic, Likar, Slivnik
// and Pernus, IEEE Trans Med Imaging 22(11), 2003). It does so only where rays touch the surface, as Livyatan, Yaniv
// and Joskowicz do (same issue). It needs no radiograph and no edges.
#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "marrow/domain/quantile.hpp"
#include "marrow/toolbox/image/grey_values.hpp"
#include "marrow/toolbox/match/views_cost.hpp"

namespace {

struct Options {
  int points = 4000;
  double sigma_px = 1.5;
  double touch_deg = 6;
  std::vector<double> weights;
};

/// A point of the surface and the CT's gradient there: the unit vector `direction` towards bone, and its length
/// `strength`, first in HU/mm, then relative to the median.
struct SurfacePoint {
  Eigen::Vector3d point_mm, normal, direction;
  double strength = 0;
};

/// Gradients of a view's line integrals, so they point towards bone too. They are in units of the view's steep
/// gradients.
struct GradientImage {
  cv::Mat u, v;    ///< CV_32F
  cv::Mat counts;  ///< CV_8U
};

/// The gradient in HU/mm: central differences of trilinear values, one voxel to each side.
Eigen::Vector3d gradient_at(const marrow::Volume& volume, const Eigen::Vector3d& point_mm) {
  const Eigen::Vector3d index = volume.grid.index_from_point(point_mm);
  Eigen::Vector3d slope;
  for (int k = 0; k < 3; ++k) {
    const Eigen::Vector3d step = Eigen::Vector3d::Unit(k);
    slope[k] = 0.5 *
               double(marrow::sample_trilinear(volume.grid, volume.values, index + step) -
                      marrow::sample_trilinear(volume.grid, volume.values, index - step)) /
               volume.grid.spacing_mm[k];
  }
  return volume.grid.direction * slope;
}

/// Points of the surface where the CT has a gradient. Points within two voxels of the CT's end are left out.
std::vector<SurfacePoint> points_of(const marrow::Volume& volume, const marrow::Mesh& mesh, int count) {
  std::vector<SurfacePoint> points;
  for (const Eigen::Vector3d& at : marrow::sample_surface(mesh, std::size_t(count))) {
    const Eigen::Vector3d index = volume.grid.index_from_point(at);
    bool is_inside = true;
    for (int k = 0; k < 3; ++k)
      is_inside = is_inside && index[k] >= 2 && index[k] <= volume.grid.size[std::size_t(k)] - 3;
    if (!is_inside) continue;
    const Eigen::Vector3d slope = gradient_at(volume, at);
    // The CT's gradient also gives the normal, because it is smoother than the triangles' normals.
    if (slope.norm() > 1e-6) points.push_back({at, -slope.normalized(), slope.normalized(), slope.norm()});
  }
  if (points.empty())
    throw marrow::Error("the volume has no gradient on the mesh: wire the volume that the mesh was made from");
  // A single bright spot must not outweigh all other points.
  std::vector<double> strengths;
  for (const SurfacePoint& point : points) strengths.push_back(point.strength);
  const double median = marrow::quantile_in_place(strengths, 0.5);
  for (SurfacePoint& point : points) point.strength = std::min(point.strength / median, 2.0);
  return points;
}

GradientImage gradients_of(const marrow::View& view, double sigma_px) {
  GradientImage image;
  cv::Mat smooth = marrow::image::line_integrals(view.image.pixels);
  image.counts = view.mask.empty() ? cv::Mat(smooth.size(), CV_8U, cv::Scalar(1)) : cv::Mat((view.mask != 0) & 1);
  image.counts.setTo(0, smooth != smooth);
  // Near the border of the mask, a gradient depends on pixels outside the mask.
  const int reach = int(std::ceil(4 * sigma_px)) + 1;
  cv::erode(image.counts, image.counts, cv::Mat::ones(2 * reach + 1, 2 * reach + 1, CV_8U));
  cv::patchNaNs(smooth, 0);
  cv::GaussianBlur(smooth, smooth, {}, sigma_px, sigma_px, cv::BORDER_REPLICATE);
  cv::Sobel(smooth, image.u, CV_32F, 1, 0, 3, 1, 0, cv::BORDER_REPLICATE);
  cv::Sobel(smooth, image.v, CV_32F, 0, 1, 3, 1, 0, cv::BORDER_REPLICATE);
  cv::Mat magnitude;
  cv::magnitude(image.u, image.v, magnitude);
  std::vector<float> steep;
  for (int row = 0; row < magnitude.rows; ++row)
    for (int column = 0; column < magnitude.cols; ++column)
      if (image.counts.at<std::uint8_t>(row, column)) steep.push_back(magnitude.at<float>(row, column));
  const double unit = steep.empty() ? 0 : marrow::quantile_in_place(steep, 0.95);
  const double scale = unit > 1e-6 ? 1 / unit : 0;  // a constant image has no gradients
  image.u *= scale;
  image.v *= scale;
  return image;
}

class GradientProjection : public marrow::match::ViewsCost {
 public:
  struct Scene {
    marrow::List<marrow::View> views;
    std::vector<SurfacePoint> points;
    Options options;
  };
  GradientProjection(std::shared_ptr<const Scene> scene, double sigma_px, std::size_t point_step)
      : ViewsCost(scene->views.size(), scene->options.weights), scene_(std::move(scene)), point_step_(point_step) {
    for (const marrow::View& view : scene_->views) images_.push_back(gradients_of(view, sigma_px));
  }

  double value_in_view(std::size_t view, const marrow::RigidTransform& world_from_model) const override {
    const Sums found = sums(view, world_from_model);
    return value_of(found.inside, found.all);
  }

  /// Uses fewer points on levels with a wider contour spacing, and smoother images on levels with a larger pixel step.
  std::shared_ptr<const marrow::Cost> at_level(const marrow::CostLevel& level) const override {
    const std::size_t step = std::size_t(std::clamp(level.contour_spacing_px, 1.0, 16.0));
    return std::make_shared<GradientProjection>(scene_, scene_->options.sigma_px * std::max(1, level.pixel_step), step);
  }

 private:
  /// Sums over the points inside image and mask, and the weight of all points.
  struct Sums {
    marrow::match::BlockSums::Sums inside;
    double all = 0;
  };

  static double value_of(const marrow::match::BlockSums::Sums& inside, double all) {
    constexpr double kLeastShare = 0.1;  // least part of the whole weight that must lie inside image and mask
    const double weight = std::max(inside.weights, kLeastShare * all);
    return weight > 0 ? 1 - inside.values / weight : 1;
  }

  std::string silence(std::size_t view, const marrow::RigidTransform& world_from_model) const override {
    return marrow::match::in_view(scene_->views, view, silence_of(sums(view, world_from_model)));
  }
  static std::string silence_of(const Sums& found) {
    if (!(found.inside.weights > 0)) return "no part of the bone that rays touch lies inside image and mask";
    if (!(found.inside.values > 0)) return "it has no gradient like the CT's where rays touch the bone";
    return {};
  }

  /// No blocks: the points that rays touch change with the pose. So each block alone has its minimum at another pose;
  /// only all of them together have it at the right one.
  Split split(std::size_t view, const marrow::RigidTransform& world_from_model) const override {
    return {value_in_view(view, world_from_model), {}};
  }

  /// Tomazevic's criterion is the sum of |a| |b| f(angle) over the points, with f = cos^4 up to a right angle. Here it
  /// is divided by the sum of |a|. |b| is in units of the image's own steep gradients and at most 1, so that a few
  /// steep ones do not dominate. The weight of a point is exp(-s^2 / 2), where s is the sine of the angle between ray
  /// and surface, divided by the sine of touch_deg.
  Sums sums(std::size_t view, const marrow::RigidTransform& world_from_model) const {
    const marrow::Camera& camera = scene_->views[view].camera;
    const marrow::RigidTransform camera_from_model = camera.camera_from_world * world_from_model;
    const Eigen::Vector3d source = inverse(camera_from_model).translation_mm;
    const double touch = std::sin(marrow::radians(scene_->options.touch_deg));
    Sums found;
    for (std::size_t i = 0; i < scene_->points.size(); i += point_step_) {
      const SurfacePoint& p = scene_->points[i];
      const double sine = p.normal.dot((p.point_mm - source).normalized()) / touch;
      if (sine * sine > 20) continue;
      const double weight = p.strength * std::exp(-0.5 * sine * sine);
      found.all += weight;
      const Eigen::Vector3d at = camera_from_model * p.point_mm;
      if (!(at.z() > 0)) continue;
      Eigen::Vector2d g;
      const Eigen::Vector2d pixel = (camera.intrinsics * at).hnormalized();
      if (!sample(images_[view], pixel, g)) continue;
      found.inside.values += weight * likeness(camera, at, camera_from_model.rotation * p.direction, g);
      found.inside.weights += weight;
    }
    return found;
  }

  /// min(|b|, 1) cos^4(angle between the CT's gradient and the back-projected image gradient). The back-projected
  /// gradient is the derivative of the image's value at the point's pixel by the position of the point. So it is
  /// perpendicular to the ray.
  static double likeness(const marrow::Camera& camera, const Eigen::Vector3d& at, const Eigen::Vector3d& direction,
                         const Eigen::Vector2d& g) {
    const double strength = g.norm();
    if (!(strength > 0)) return 0;
    const Eigen::Matrix3d& k = camera.intrinsics;
    const Eigen::Vector2d scaled = k.topLeftCorner<2, 2>().transpose() * g;
    const Eigen::Vector3d back(scaled.x(), scaled.y(), -(scaled.x() * at.x() + scaled.y() * at.y()) / at.z());
    const double cosine = back.dot(direction) / back.norm();
    return cosine > 0 ? std::min(strength, 1.0) * std::pow(cosine, 4) : 0;
  }

  /// Bilinear interpolation. False if one of the four pixels is outside the image or does not count.
  static bool sample(const GradientImage& image, const Eigen::Vector2d& pixel, Eigen::Vector2d& g) {
    if (!(pixel.x() >= 0 && pixel.y() >= 0 && pixel.x() < image.u.cols - 1 && pixel.y() < image.u.rows - 1))
      return false;
    const int u = int(pixel.x()), v = int(pixel.y());
    const float x = float(pixel.x() - u), y = float(pixel.y() - v);
    const auto* near = image.counts.ptr<std::uint8_t>(v) + u;
    const auto* far = image.counts.ptr<std::uint8_t>(v + 1) + u;
    if (!near[0] || !near[1] || !far[0] || !far[1]) return false;
    const auto value = [&](const cv::Mat& values) {
      const float* a = values.ptr<float>(v) + u;
      const float* b = values.ptr<float>(v + 1) + u;
      return double((1 - y) * ((1 - x) * a[0] + x * a[1]) + y * ((1 - x) * b[0] + x * b[1]));
    };
    g = {value(image.u), value(image.v)};
    return true;
  }

  std::shared_ptr<const Scene> scene_;
  const std::size_t point_step_;
  std::vector<GradientImage> images_;
};

std::shared_ptr<const marrow::Cost> gradient_projection(
    const marrow::Mesh& mesh, const marrow::Volume& volume, const marrow::List<marrow::View>& views,
    const marrow::RadiographProjector* projector, const marrow::List<marrow::Pose>* others,
    const marrow::List<marrow::RadiographProjector>* other_projectors,
    const marrow::List<marrow::OutlineProjector>* other_outlines, const Options& options, marrow::Context& context) {
  marrow::check_mesh(mesh, "the mesh of the bone");
  marrow::check_volume(volume, "the volume that the mesh was made from");
  marrow::check_lies_in(mesh, volume.grid, "the mesh", "the volume");
  marrow::match::check_views(views);
  marrow::match::check_weights(options.weights, views.size());
  for (const marrow::View& view : views) marrow::image::warn_of_greys(view, context);
  const marrow::List<marrow::View> own = marrow::match::without_shadows(
      views, marrow::match::shadows_of(projector, others, other_projectors, other_outlines));
  const auto scene = std::make_shared<GradientProjection::Scene>(
      GradientProjection::Scene{own, points_of(volume, mesh, options.points), options});
  return std::make_shared<GradientProjection>(scene, options.sigma_px, 1);
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("similarity.gradient_projection", gradient_projection)
      .summary(
          "1 - similarity of the back-projected image gradients and the CT's gradients where rays touch the bone "
          "(Tomazevic et al.; Livyatan et al., IEEE TMI 2003); it predicts no deviations")
      .trait("unmoved_by_gain")
      .in("model", "surface of the bone")
      .in("volume", "CT from which the surface was made")
      .in("views", "views with their cameras and masks", marrow::over("view"))
      .in("projector", "projector of this fragment's radiographs; it identifies this fragment in other_projectors")
      .in("others", "poses of other fragments; pixels that show these fragments are left out", marrow::over("fragment"))
      .in("other_projectors", "projectors of the other fragments' radiographs; this fragment's own may be among them",
          marrow::over("fragment"))
      .in("other_outlines",
          "outline projectors of other bodies that are known only as surfaces; pixels that show these bodies are left "
          "out",
          marrow::over("fragment"))
      .out("cost", "disagreement of the gradients, from 0 to 1")
      .option("points", &Options::points,
              "number of points spread over the surface; only points near its outlines count", marrow::at_least(100),
              marrow::at_most(1000000))
      .option("sigma_px", &Options::sigma_px, "standard deviation of the Gaussian that smooths the images",
              marrow::at_least(0.5), marrow::at_most(20))
      .option("touch_deg", &Options::touch_deg,
              "the larger the angle between ray and surface compared with this angle, the less a point counts",
              marrow::at_least(1), marrow::at_most(45))
      .option("weights", &Options::weights, "weight of each view; empty: all views have the same weight");
}
