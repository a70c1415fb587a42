// SPDX-License-Identifier: Apache-2.0
#include "marrow/initial/reprojection_fit.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <marrow/domain/decompositions.hpp>

#include "marrow/toolbox/geometry/rigid_fit.hpp"

namespace marrow::initial {
namespace {

/// Half the Gauss-Newton Hessian and half the gradient of the sum of squares, with respect to the small motion.
struct Normal {
  Matrix6d curvature = Matrix6d::Zero();
  Vector6d gradient = Vector6d::Zero();
};

Normal normal_at(const std::vector<Sight>& sights, const RigidTransform& pose, const FragmentFrame& frame) {
  Normal normal;
  for (const Sight& sight : sights) {
    const Camera& camera = *sight.camera;
    const Eigen::Vector3d image = camera.intrinsics * (camera.camera_from_world * (pose * sight.model_mm));
    const Eigen::Vector2d pixel = image.hnormalized();
    Eigen::Matrix<double, 2, 3> by_image;
    by_image << 1, 0, -pixel.x(), 0, 1, -pixel.y();
    const Eigen::Matrix<double, 2, 6> by_motion = by_image / image.z() * camera.intrinsics *
                                                  camera.camera_from_world.rotation * pose.rotation *
                                                  geometry::point_by_motion(frame, sight.model_mm);
    const double weight = 1 / (sight.deviation_px * sight.deviation_px);
    normal.curvature += weight * by_motion.transpose() * by_motion;
    normal.gradient += weight * by_motion.transpose() * (pixel - sight.pixel);
  }
  return normal;
}

}  // namespace

double square_of(const Sight& sight, const RigidTransform& pose) {
  const Eigen::Vector2d off = project(*sight.camera, pose * sight.model_mm) - sight.pixel;
  return off.allFinite() ? off.squaredNorm() / (sight.deviation_px * sight.deviation_px)
                         : std::numeric_limits<double>::infinity();
}

double squares_of(const std::vector<Sight>& sights, const RigidTransform& pose) {
  double sum = 0;
  for (const Sight& sight : sights) sum += square_of(sight, pose);
  return sum;
}

Matrix6d curvature_at(const std::vector<Sight>& sights, const RigidTransform& pose, const FragmentFrame& frame) {
  return normal_at(sights, pose, frame).curvature;
}

RigidTransform refined(const std::vector<Sight>& sights, RigidTransform pose, const FragmentFrame& frame) {
  double value = squares_of(sights, pose), damping = 1e-3;
  for (int steps = 0; std::isfinite(value) && steps < 200 && damping < 1e12; ++steps) {
    const Normal normal = normal_at(sights, pose, frame);
    Matrix6d damped = normal.curvature;
    damped.diagonal() *= 1 + damping;
    const RigidTransform there = moved(pose, frame, -solve_symmetric(damped, normal.gradient));
    const double value_there = squares_of(sights, there);
    if (value_there < value) {
      const bool is_last = value - value_there <= 1e-14 * value;
      pose = there;
      value = value_there;
      damping *= 0.1;
      if (is_last) break;
    } else {
      damping *= 10;
    }
  }
  return pose;
}

std::vector<Candidate> minima(const std::vector<Sight>& sights, const FragmentFrame& frame) {
  std::vector<Candidate> found;
  for (const RigidTransform& start : pose_starts(sights)) {
    const RigidTransform pose = refined(sights, start, frame);
    if (const double squares = squares_of(sights, pose); std::isfinite(squares)) found.push_back({pose, squares});
  }
  std::stable_sort(found.begin(), found.end(),
                   [](const Candidate& a, const Candidate& b) { return a.squares < b.squares; });
  return found;
}

}  // namespace marrow::initial
