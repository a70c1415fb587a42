// SPDX-License-Identifier: Apache-2.0
#include "marrow/initial/reprojection_fit.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <marrow/domain/decompositions.hpp>
#include <opencv2/calib3d.hpp>

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

namespace {

std::vector<std::string> different(const std::vector<Sight>& sights, std::string Sight::*name) {
  std::vector<std::string> names;
  for (const Sight& sight : sights)
    if (std::find(names.begin(), names.end(), sight.*name) == names.end()) names.push_back(sight.*name);
  return names;
}

/// The point nearest to the rays of all views that show it. std::nullopt for one ray only or nearly parallel rays.
std::optional<Eigen::Vector3d> triangulated(const std::vector<Sight>& sights, const std::string& name) {
  constexpr double kLeastParallax = 1e-3;  // squared sine of 1.8 degrees
  Eigen::Matrix3d across = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  for (const Sight& sight : sights) {
    if (sight.name != name) continue;
    const Eigen::Vector3d ray = ray_direction(*sight.camera, sight.pixel);
    const Eigen::Matrix3d off = Eigen::Matrix3d::Identity() - ray * ray.transpose();
    across += off;
    right += off * source_position_mm(*sight.camera);
  }
  // The determinant is 0 for one ray. For two rays it is twice the squared sine of the angle between them.
  if (across.determinant() < 2 * kLeastParallax) return std::nullopt;
  return across.inverse() * right;
}

/// A plane looks nearly the same when it is tilted to the other side of the beam. This is the pose tilted in this way,
/// about the axis across the beam and the plane's normal.
RigidTransform tilted_back(const RigidTransform& camera_from_model, const std::vector<Sight>& sights) {
  std::vector<Eigen::Vector3d> points;
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  for (const Sight& sight : sights) {
    points.push_back(sight.model_mm);
    centre += sight.model_mm / double(sights.size());
  }
  const Eigen::Vector3d normal = camera_from_model.rotation * geometry::plane_normal(points);
  const Eigen::Vector3d there = camera_from_model * centre,
                        beam = normal.dot(there) < 0 ? Eigen::Vector3d(-there.normalized()) : there.normalized();
  const Eigen::Vector3d axis = normal.cross(beam);
  const double sine = axis.norm(), leaning_rad = std::atan2(sine, normal.dot(beam));
  const Eigen::Matrix3d turn = rotation_from_vector(2 * leaning_rad / std::max(sine, 1e-12) * axis);
  RigidTransform tilted = camera_from_model;
  tilted.rotation = turn * camera_from_model.rotation;
  tilted.translation_mm = there - tilted.rotation * centre;
  return tilted;
}

/// For three points: all poses that project them exactly (Ke and Roumeliotis, CVPR 2017). For more points: the pose of
/// least algebraic error (Terzakis and Lourakis, ECCV 2020). Each also tilted to the other side.
std::vector<RigidTransform> starts_of_view(const std::vector<Sight>& sights) {
  std::vector<cv::Point3d> points;
  std::vector<cv::Point2d> directions;
  for (const Sight& sight : sights) {
    const Eigen::Vector2d direction = (sight.camera->intrinsics.inverse() * sight.pixel.homogeneous()).hnormalized();
    points.emplace_back(sight.model_mm.x(), sight.model_mm.y(), sight.model_mm.z());
    directions.emplace_back(direction.x(), direction.y());
  }
  std::vector<cv::Mat> turns, shifts;
  try {
    if (sights.size() == 3)
      cv::solveP3P(points, directions, cv::Matx33d::eye(), cv::noArray(), turns, shifts, cv::SOLVEPNP_AP3P);
    else
      cv::solvePnPGeneric(points, directions, cv::Matx33d::eye(), cv::noArray(), turns, shifts, false,
                          cv::SOLVEPNP_SQPNP);
  } catch (const cv::Exception&) {
    return {};  // points on a line; other views may still give a start
  }
  std::vector<RigidTransform> starts;
  for (std::size_t i = 0; i < turns.size(); ++i) {
    const auto vector = [](const cv::Mat& mat) {
      return Eigen::Vector3d(mat.at<double>(0), mat.at<double>(1), mat.at<double>(2));
    };
    const RigidTransform camera_from_model{"camera", "ct", rotation_from_vector(vector(turns[i])), vector(shifts[i])};
    if (!camera_from_model.rotation.allFinite() || !camera_from_model.translation_mm.allFinite()) continue;
    for (const RigidTransform& one : {camera_from_model, tilted_back(camera_from_model, sights)})
      starts.push_back(inverse(sights.front().camera->camera_from_world) * one);
  }
  return starts;
}

}  // namespace

std::vector<RigidTransform> pose_starts(const std::vector<Sight>& sights) {
  std::vector<RigidTransform> starts;
  std::vector<Eigen::Vector3d> model_mm, world_mm;
  for (const std::string& name : different(sights, &Sight::name))
    if (const auto place = triangulated(sights, name)) {
      model_mm.push_back(
          std::find_if(sights.begin(), sights.end(), [&](const Sight& sight) { return sight.name == name; })->model_mm);
      world_mm.push_back(*place);
    }
  if (model_mm.size() >= 3 && !geometry::lie_on_a_line(model_mm) && !geometry::lie_on_a_line(world_mm))
    starts.push_back(geometry::fit_rigid(model_mm, world_mm, "the landmarks that two views show"));
  for (const std::string& view : different(sights, &Sight::view)) {
    std::vector<Sight> in_view;
    for (const Sight& sight : sights)
      if (sight.view == view) in_view.push_back(sight);
    if (in_view.size() < 3) continue;
    for (const RigidTransform& start : starts_of_view(in_view)) starts.push_back(start);
  }
  return starts;
}

}  // namespace marrow::initial
