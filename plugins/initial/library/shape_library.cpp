// SPDX-License-Identifier: Apache-2.0
#include "marrow/initial/shape_library.hpp"

#include <oneapi/tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "marrow/toolbox/geometry/silhouette_image.hpp"

namespace marrow::initial {
namespace {

constexpr int kDrawn_px = 100;  ///< the surface's diameter in a drawing

/// The direction number `i` of `count`, spread evenly over the sphere (Fibonacci's lattice).
Eigen::Vector3d direction(int i, int count) {
  const double z = 1 - (2 * i + 1.0) / count, around = i * kPi * (3 - std::sqrt(5.0)), across = std::sqrt(1 - z * z);
  return {across * std::cos(around), across * std::sin(around), z};
}

/// The least rotation that turns one direction into another.
Eigen::Matrix3d turned(const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
  return Eigen::Quaterniond::FromTwoVectors(from, to).toRotationMatrix();
}

/// Outlines as another camera at the same place sees them, which looks along a ray.
std::vector<Eigen::Vector2d> seen_along(const std::vector<Eigen::Vector2d>& rays, const Eigen::Matrix3d& looking) {
  std::vector<Eigen::Vector2d> result;
  for (const Eigen::Vector2d& ray : rays) result.push_back((looking * ray.homogeneous()).hnormalized());
  return result;
}

Eigen::AlignedBox3d box_of(const Mesh& mesh) {
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& vertex : mesh.vertices_mm) box.extend(vertex);
  return box;
}

}  // namespace

ShapeLibrary::ShapeLibrary(const Mesh& surface, const SeenSilhouette& about, int directions, Context& context)
    : frame_(surface.frame), middle_mm_(box_of(surface).center()) {
  double radius_mm = 0, mean_square_mm2 = 0;
  for (const Eigen::Vector3d& vertex : surface.vertices_mm) {
    const double square = (vertex - middle_mm_).squaredNorm();
    radius_mm = std::max(radius_mm, std::sqrt(square));
    mean_square_mm2 += square / double(surface.vertices_mm.size());
  }
  // Two of three coordinates of a vertex are seen.
  const double size = outline_shape(outline_rays(about.mask, about.camera)).size;
  distance_mm_ = std::max(std::sqrt(2 * mean_square_mm2 / 3) / size, 2 * radius_mm);
  Camera camera;
  camera.width_px = camera.height_px = kDrawn_px + 20;
  const double focal_px = 0.5 * kDrawn_px * (distance_mm_ - radius_mm) / radius_mm, middle_px = 0.5 * (kDrawn_px + 19);
  camera.intrinsics << focal_px, 0, middle_px, 0, focal_px, middle_px, 0, 0, 1;
  sides_.resize(std::size_t(directions));
  tbb::parallel_for(0, directions, [&](int i) {
    context.check_cancelled();
    Side& side = sides_[std::size_t(i)];
    side.camera_from_model = turned(direction(i, directions), Eigen::Vector3d::UnitZ());
    const Eigen::Vector3d there_mm = Eigen::Vector3d(0, 0, distance_mm_) - side.camera_from_model * middle_mm_;
    const cv::Mat1b mask =
        geometry::silhouette_image(surface, camera, {"world", frame_, side.camera_from_model, there_mm}) >= 0;
    side.shape = outline_shape(outline_rays(mask, camera));
  });
}

std::vector<ShapeLibrary::Match> ShapeLibrary::matches(const SeenSilhouette& seen) const {
  const std::vector<Eigen::Vector2d> rays = outline_rays(seen.mask, seen.camera);
  const std::complex<double> middle = outline_shape(rays).middle;
  const Eigen::Matrix3d looking = turned(Eigen::Vector3d(middle.real(), middle.imag(), 1), Eigen::Vector3d::UnitZ());
  const OutlineShape shape = outline_shape(seen_along(rays, looking));
  const RigidTransform world_from_camera = inverse(seen.camera.camera_from_world);
  std::vector<Match> matches(sides_.size());
  tbb::parallel_for(std::size_t(0), sides_.size(), [&](std::size_t i) {
    const Side& side = sides_[i];
    const Likeness alike = likeness(shape, side.shape);
    const double scale = shape.size / side.shape.size;
    const std::complex<double> at = shape.middle - scale * std::polar(1.0, alike.turn_rad) * side.shape.middle;
    const Eigen::Vector3d ray(at.real(), at.imag(), 1);
    const Eigen::Matrix3d in_image = Eigen::AngleAxisd(alike.turn_rad, Eigen::Vector3d::UnitZ()).toRotationMatrix();
    RigidTransform camera_from_model{seen.camera.camera_from_world.target, frame_};
    camera_from_model.rotation =
        looking.transpose() * turned(Eigen::Vector3d::UnitZ(), ray) * in_image * side.camera_from_model;
    camera_from_model.translation_mm =
        looking.transpose() * (distance_mm_ / scale * ray) - camera_from_model.rotation * middle_mm_;
    matches[i] = {world_from_camera * camera_from_model, alike.value};
  });
  std::stable_sort(matches.begin(), matches.end(),
                   [](const Match& a, const Match& b) { return a.likeness > b.likeness; });
  return matches;
}

}  // namespace marrow::initial
