// SPDX-License-Identifier: Apache-2.0
// Gradients of the images, projected back to the surface, against those of the CT: Tomazevic, Likar, Slivnik and Pernus
// (IEEE Trans Med Imaging 22(11), 2003), only where rays touch the surface as Livyatan, Yaniv and Joskowicz do (same
// issue). Needs no radiograph and no edges.
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "marrow/toolbox/match/intensity.hpp"

namespace {

struct Options {
  int points = 4000;
  double blur_px = 1.5;
  double touch_deg = 6;
  std::vector<double> weights;
};

/// A point of the surface, and there the CT's gradient [HU/mm]: towards bone.
struct SurfacePoint {
  Eigen::Vector3d point_mm, normal, direction;
  double strength = 0;
};

/// A view's gradients: of line integrals, so towards bone as well, in units of the steep ones.
struct GradientImage {
  cv::Mat u, v;    ///< CV_32F
  cv::Mat counts;  ///< CV_8U
};

/// The gradient of the trilinear volume over one voxel to each side.
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

/// Points of the surface where the CT changes across it; within two voxels of its end it does not tell.
std::vector<SurfacePoint> points_of(const marrow::Volume& volume, const marrow::Mesh& mesh, int count) {
  std::vector<SurfacePoint> points;
  for (const Eigen::Vector3d& at : marrow::sample_surface(mesh, std::size_t(count))) {
    const Eigen::Vector3d index = volume.grid.index_from_point(at);
    bool is_inside = true;
    for (int k = 0; k < 3; ++k)
      is_inside = is_inside && index[k] >= 2 && index[k] <= volume.grid.size[std::size_t(k)] - 3;
    if (!is_inside) continue;
    const Eigen::Vector3d slope = gradient_at(volume, at);
    // The CT's own gradient is the normal as well: less rough than the triangles'.
    if (slope.norm() > 1e-6) points.push_back({at, -slope.normalized(), slope.normalized(), slope.norm()});
  }
  if (points.empty())
    throw marrow::Error("the volume has no gradient on the mesh: wire the volume that the mesh was made from");
  // One bright spot shall not outweigh the rest.
  std::vector<double> strengths;
  for (const SurfacePoint& point : points) strengths.push_back(point.strength);
  std::nth_element(strengths.begin(), strengths.begin() + std::ptrdiff_t(strengths.size() / 2), strengths.end());
  const double median = strengths[strengths.size() / 2];
  for (SurfacePoint& point : points) point.strength = std::min(point.strength / median, 2.0);
  return points;
}

GradientImage gradients_of(const marrow::View& view, double blur_px) {
  GradientImage image;
  cv::Mat smooth = marrow::match::line_integrals(view.image.pixels);
  image.counts = view.mask.empty() ? cv::Mat(smooth.size(), CV_8U, cv::Scalar(1)) : cv::Mat((view.mask != 0) & 1);
  image.counts.setTo(0, smooth != smooth);
  // Near the mask's end a gradient is in part of what lies beyond.
  const int reach = int(std::ceil(4 * blur_px)) + 1;
  cv::erode(image.counts, image.counts, cv::Mat::ones(2 * reach + 1, 2 * reach + 1, CV_8U));
  cv::patchNaNs(smooth, 0);
  cv::GaussianBlur(smooth, smooth, {}, blur_px, blur_px, cv::BORDER_REPLICATE);
  cv::Sobel(smooth, image.u, CV_32F, 1, 0, 3, 1, 0, cv::BORDER_REPLICATE);
  cv::Sobel(smooth, image.v, CV_32F, 0, 1, 3, 1, 0, cv::BORDER_REPLICATE);
  cv::Mat magnitude;
  cv::magnitude(image.u, image.v, magnitude);
  std::vector<float> steep;
  for (int row = 0; row < magnitude.rows; ++row)
    for (int column = 0; column < magnitude.cols; ++column)
      if (image.counts.at<std::uint8_t>(row, column)) steep.push_back(magnitude.at<float>(row, column));
  float unit = 0;
  if (!steep.empty()) {
    const auto at = steep.begin() + std::ptrdiff_t(0.95 * double(steep.size() - 1));
    std::nth_element(steep.begin(), at, steep.end());
    unit = *at;
  }
  const double scale = unit > 1e-6f ? 1 / double(unit) : 0;  // of an even image nothing is left
  image.u *= scale;
  image.v *= scale;
  return image;
}

class GradientProjection : public marrow::Cost {
 public:
  struct Scene {
    marrow::List<marrow::View> views;
    std::vector<SurfacePoint> points;
    Options options;
  };
  GradientProjection(std::shared_ptr<const Scene> scene, double blur_px, std::size_t point_step)
      : scene_(std::move(scene)), point_step_(point_step) {
    for (const marrow::View& view : scene_->views) images_.push_back(gradients_of(view, blur_px));
  }

  double value(const marrow::RigidTransform& world_from_model) const override {
    std::vector<double> of_view(images_.size());
    tbb::parallel_for(std::size_t(0), of_view.size(),
                      [&](std::size_t i) { of_view[i] = value_in(i, world_from_model); });
    return marrow::match::weighted_mean(of_view, scene_->options.weights);
  }

  /// Fewer points where an outline's would be further apart; smoother images where pixels would be.
  std::shared_ptr<const marrow::Cost> at_level(const marrow::CostLevel& level) const override {
    const std::size_t step = std::size_t(std::clamp(level.contour_spacing_px, 1.0, 16.0));
    return std::make_shared<GradientProjection>(scene_, scene_->options.blur_px * std::max(1, level.pixel_step), step);
  }

 private:
  /// Of Tomazevic's criterion, the sum of |a| |b| f(angle) over the points, with f = cos^4 up to a right angle: over
  /// the sum of |a|, with |b| in units of the image's own steep gradients and no more than 1, so that a few steep ones
  /// do not decide. Each point counts by exp(-s^2/2): s = sine of the angle between ray and surface, over that of
  /// touch_deg.
  double value_in(std::size_t view, const marrow::RigidTransform& world_from_model) const {
    constexpr double kLeastShare = 0.1;  // of the weight of all, that must lie inside of image and mask
    const marrow::Camera& camera = scene_->views[view].camera;
    const marrow::RigidTransform camera_from_model = camera.camera_from_world * world_from_model;
    const Eigen::Vector3d source = inverse(camera_from_model).translation_mm;
    const double touch = std::sin(marrow::radians(scene_->options.touch_deg));
    double sum = 0, inside = 0, all = 0;
    for (std::size_t i = 0; i < scene_->points.size(); i += point_step_) {
      const SurfacePoint& p = scene_->points[i];
      const double sine = p.normal.dot((p.point_mm - source).normalized()) / touch;
      if (sine * sine > 20) continue;
      const double weight = p.strength * std::exp(-0.5 * sine * sine);
      all += weight;
      const Eigen::Vector3d at = camera_from_model * p.point_mm;
      if (!(at.z() > 0)) continue;
      Eigen::Vector2d g;
      if (!sample(images_[view], (camera.intrinsics * at).hnormalized(), g)) continue;
      inside += weight;
      sum += weight * likeness(camera, at, camera_from_model.rotation * p.direction, g);
    }
    inside = std::max(inside, kLeastShare * all);
    return inside > 0 ? 1 - sum / inside : 1;
  }

  /// min(|b|, 1) cos^4 of the angle between the CT's gradient and the image's, projected back: what the image's value
  /// at the point's pixel would change by as the point moved, so at right angles to the ray.
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

  /// Bilinear; false where a pixel is out or does not count.
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
    const marrow::List<marrow::OutlineProjector>* other_outlines, const Options& options) {
  marrow::check_mesh(mesh, "the mesh of the bone");
  marrow::check_volume(volume, "the volume that the mesh was made from");
  if (volume.grid.frame != mesh.frame)
    throw marrow::Error("the mesh is in frame '" + mesh.frame + "', but the volume in frame '" + volume.grid.frame +
                        "'; give the volume that the mesh was made from");
  marrow::match::check_views(views);
  marrow::match::check_weights(options.weights, views.size());
  const marrow::List<marrow::View> own = marrow::match::without_shadows(
      views, marrow::match::shadows_of(projector, others, other_projectors, other_outlines));
  const auto scene = std::make_shared<GradientProjection::Scene>(
      GradientProjection::Scene{own, points_of(volume, mesh, options.points), options});
  return std::make_shared<GradientProjection>(scene, options.blur_px, 1);
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("similarity.gradient_projection", gradient_projection)
      .summary(
          "1 - likeness of the images' gradients, projected back, and the CT's where rays touch the bone (Tomazevic et "
          "al.; Livyatan et al., IEEE TMI 2003)")
      .trait("unmoved_by_gain")
      .in("mesh", "surface of the bone")
      .in("volume", "CT that the surface was made from")
      .in("views", "views with their cameras and masks", marrow::over("view"))
      .in("projector", "makes radiographs of this fragment: tells it from the others")
      .in("others", "where other fragments are, whose shadows are left out", marrow::over("fragment"))
      .in("other_projectors", "draw them, and maybe this one", marrow::over("fragment"))
      .in("other_outlines", "draw other bodies that are known as surfaces only; their shadows are left out",
          marrow::over("fragment"))
      .out("cost", "how badly the gradients agree, 0 to 1")
      .option("points", &Options::points, "spread over the surface, of which those near its outlines count",
              marrow::at_least(100), marrow::at_most(1000000))
      .option("blur_px", &Options::blur_px, "smoothing of the images: standard deviation of a Gaussian",
              marrow::at_least(0.5), marrow::at_most(20))
      .option("touch_deg", &Options::touch_deg, "angle between ray and surface by which a point counts less",
              marrow::at_least(1), marrow::at_most(45))
      .option("weights", &Options::weights, "of each view; none: all the same");
}
