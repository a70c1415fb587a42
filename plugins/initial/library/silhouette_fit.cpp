// SPDX-License-Identifier: Apache-2.0
#include "marrow/initial/silhouette_fit.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "marrow/domain/decompositions.hpp"
#include "marrow/toolbox/geometry/rigid_fit.hpp"
#include "marrow/toolbox/geometry/silhouette_image.hpp"

namespace marrow::initial {
namespace {

/// The signed distance of one point of the outline from the border of the mask, and its derivative by the motion.
struct Residual {
  double mm;
  Vector6d by_motion;
  double pixel_mm;  ///< the width of a pixel there
};

/// The value of the distance at a pixel and its derivatives along the image's axes.
Eigen::Vector3d distance_at(const cv::Mat1f& distance, const cv::Point& pixel) {
  return {distance(pixel), 0.5 * (distance(pixel.y, pixel.x + 1) - distance(pixel.y, pixel.x - 1)),
          0.5 * (distance(pixel.y + 1, pixel.x) - distance(pixel.y - 1, pixel.x))};
}

void add_residuals(const SeenSilhouette& seen, const cv::Mat1i& triangle_of, const Mesh& surface,
                   const FragmentFrame& frame, const RigidTransform& pose, std::vector<Residual>& residuals) {
  std::vector<std::vector<cv::Point>> chains;
  const cv::Mat1b drawn = triangle_of >= 0;
  cv::findContours(drawn, chains, cv::RETR_EXTERNAL, cv::CHAIN_APPROX_NONE);
  const RigidTransform camera_from_model = seen.camera.camera_from_world * pose;
  for (const auto& chain : chains)
    for (const cv::Point& pixel : chain) {
      if (std::min({pixel.x, pixel.y, drawn.cols - 1 - pixel.x, drawn.rows - 1 - pixel.y}) < 1) continue;
      const auto& t = surface.triangles[std::size_t(triangle_of(pixel))];
      const Eigen::Vector3d model_mm =
          (surface.vertices_mm[t[0]] + surface.vertices_mm[t[1]] + surface.vertices_mm[t[2]]) / 3;
      const Eigen::Vector3d image = seen.camera.intrinsics * (camera_from_model * model_mm);
      const Eigen::Vector2d at = image.hnormalized();
      Eigen::Matrix<double, 2, 3> by_image;
      by_image << 1, 0, -at.x(), 0, 1, -at.y();
      const Eigen::Vector3d value = distance_at(seen.distance, pixel);
      const double mm_per_px = pixel_size_at_mm(seen.camera, pose * model_mm);
      const Eigen::RowVector3d by_model =
          value.tail<2>().transpose() * by_image / image.z() * seen.camera.intrinsics * camera_from_model.rotation;
      // The part ends half a pixel beyond the centre of its last pixel.
      residuals.push_back({mm_per_px * (value[0] + 0.5),
                           mm_per_px * (by_model * geometry::point_by_motion(frame, model_mm)).transpose(), mm_per_px});
    }
}

/// The motion of least weighted squares; of zero length if the outline says nothing.
Vector6d step_of(const std::vector<Residual>& residuals, bool only_shift) {
  std::vector<double> sizes;
  for (const Residual& one : residuals) sizes.push_back(std::abs(one.mm));
  if (sizes.size() < 6) return Vector6d::Zero();
  std::nth_element(sizes.begin(), sizes.begin() + std::ptrdiff_t(sizes.size() / 2), sizes.end());
  // Not less than two pixels: a few points that stick out of a smooth part may be all that tells its turn.
  const double usual_mm = std::max(1.5 * sizes[sizes.size() / 2], 2 * residuals[0].pixel_mm);
  Matrix6d curvature = Matrix6d::Zero();
  Vector6d gradient = Vector6d::Zero();
  for (const Residual& one : residuals) {
    const double weight = std::min(1.0, usual_mm / std::max(std::abs(one.mm), 1e-9));
    curvature += weight * one.by_motion * one.by_motion.transpose();
    gradient += weight * one.mm * one.by_motion;
  }
  constexpr double kDamping = 1e-3;
  curvature.diagonal() *= 1 + kDamping;
  Vector6d motion = Vector6d::Zero();
  if (only_shift)
    motion.tail<3>() = -solve_symmetric<3>(curvature.bottomRightCorner<3, 3>(), gradient.tail<3>());
  else
    motion = -solve_symmetric<6>(curvature, gradient);
  if (!motion.allFinite()) return Vector6d::Zero();
  constexpr double kMostRad = 0.2;  // a longer step leaves the range in which the outline moves as its points do
  if (const double turn = motion.head<3>().norm(); turn > kMostRad) motion *= kMostRad / turn;
  return motion;
}

}  // namespace

double mean_overlap(const std::vector<SeenSilhouette>& views, const Mesh& surface,
                    const RigidTransform& world_from_model) {
  double sum = 0;
  for (const SeenSilhouette& seen : views)
    sum += overlap(geometry::silhouette_image(surface, seen.camera, world_from_model) >= 0, seen.mask);
  return sum / double(views.size());
}

Fitted fitted(const std::vector<SeenSilhouette>& views, const Mesh& surface, const FragmentFrame& frame,
              const RigidTransform& start, int steps) {
  const int shifts = views.size() > 1 ? 4 : 0;
  Fitted best{start, 0};
  RigidTransform pose = start;
  for (int i = 0;; ++i) {
    std::vector<Residual> residuals;
    double sum = 0;
    for (const SeenSilhouette& seen : views) {
      const cv::Mat1i triangle_of = geometry::silhouette_image(surface, seen.camera, pose);
      sum += overlap(triangle_of >= 0, seen.mask) / double(views.size());
      add_residuals(seen, triangle_of, surface, frame, pose, residuals);
    }
    if (sum > best.overlap) best = {pose, sum};
    if (i == shifts + steps) return best;
    const Vector6d motion = step_of(residuals, i < shifts);
    if (motion.head<3>().norm() < 1e-4 && motion.tail<3>().norm() < 1e-2 && i >= shifts) return best;
    pose = moved(pose, frame, motion);
  }
}

}  // namespace marrow::initial
