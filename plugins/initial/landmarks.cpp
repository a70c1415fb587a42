// SPDX-License-Identifier: Apache-2.0
// A start from landmarks that were marked in one view or more. First poses are computed in several ways: from points
// that two views show, and from each view alone. Each is refined over all views at once. The best one is the result.
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <marrow/plugin.hpp>

#include <marrow/domain/decompositions.hpp>
#include "marrow/base/number_text.hpp"
#include "marrow/initial/pose_starts.hpp"
#include "marrow/toolbox/geometry/rigid_fit.hpp"

namespace {

using namespace marrow;
using initial::Sight;

struct Options {
  double noise_px = 1;
};

std::vector<Sight> sights_of(const Landmarks& landmarks, const List<View>& views, const Context& context) {
  std::vector<Sight> sights;
  std::vector<std::string> unknown;
  for (const Landmarks::Seen& seen : landmarks.seen) {
    const auto point = std::find_if(landmarks.points.begin(), landmarks.points.end(),
                                    [&](const auto& one) { return one.name == seen.name; });
    if (point == landmarks.points.end())
      throw Error("view '" + seen.view + "' shows '" + seen.name +
                  "', but the landmarks have no point of that name in the CT; give its place there, or leave it out");
    if (const View* view = views.find(seen.view)) {
      check_camera(view->camera, "view '" + seen.view + "'");
      sights.push_back({seen.name, seen.view, point->model_mm, seen.pixel, &view->camera});
    } else if (std::find(unknown.begin(), unknown.end(), seen.view) == unknown.end()) {
      unknown.push_back(seen.view);
      context.warn("landmarks are seen in a view '" + seen.view + "', which is none of the views; they are left out");
    }
  }
  return sights;
}

/// Throws Error if there are too few points for a pose, or if they lie on a line.
void check_enough(const std::vector<Sight>& sights) {
  std::vector<std::string> names, views;
  std::vector<Eigen::Vector3d> points;
  for (const Sight& sight : sights) {
    if (std::find(views.begin(), views.end(), sight.view) == views.end()) views.push_back(sight.view);
    if (std::find(names.begin(), names.end(), sight.name) != names.end()) continue;
    names.push_back(sight.name);
    points.push_back(sight.model_mm);
  }
  const std::size_t least = views.size() > 1 ? 3 : 4;
  if (names.size() < least)
    throw Error(formatted("{} landmarks are seen in {}; a pose needs three that are seen in two views, or four in one",
                          names.size(), counted(views.size(), "view")));
  geometry::check_spread(points, "the landmarks that are seen");
}

/// Sum of squared reprojection errors [px^2]; infinite if a landmark lies behind a source.
double squares_px(const std::vector<Sight>& sights, const RigidTransform& pose) {
  double sum = 0;
  for (const Sight& sight : sights) {
    const Eigen::Vector2d off = project(*sight.camera, pose * sight.model_mm) - sight.pixel;
    sum += off.allFinite() ? off.squaredNorm() : std::numeric_limits<double>::infinity();
  }
  return sum;
}

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
    normal.curvature += by_motion.transpose() * by_motion;
    normal.gradient += by_motion.transpose() * (pixel - sight.pixel);
  }
  return normal;
}

/// Least squares over all views with damped steps (Marquardt, SIAM J Appl Math 1963).
RigidTransform refined(const std::vector<Sight>& sights, RigidTransform pose, const FragmentFrame& frame) {
  double value = squares_px(sights, pose), damping = 1e-3;
  for (int steps = 0; std::isfinite(value) && steps < 200 && damping < 1e12; ++steps) {
    const Normal normal = normal_at(sights, pose, frame);
    Matrix6d damped = normal.curvature;
    damped.diagonal() *= 1 + damping;
    const RigidTransform there = moved(pose, frame, -solve_symmetric(damped, normal.gradient));
    const double value_there = squares_px(sights, there);
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

struct Candidate {
  RigidTransform pose;
  double squares_px;
};

/// The minima found from the starts, the lowest first.
std::vector<Candidate> minima(const std::vector<Sight>& sights, const FragmentFrame& frame) {
  std::vector<Candidate> found;
  for (const RigidTransform& start : initial::pose_starts(sights)) {
    const RigidTransform pose = refined(sights, start, frame);
    if (const double squares = squares_px(sights, pose); std::isfinite(squares)) found.push_back({pose, squares});
  }
  std::stable_sort(found.begin(), found.end(),
                   [](const Candidate& a, const Candidate& b) { return a.squares_px < b.squares_px; });
  return found;
}

/// Throws Error if another pose explains the landmarks nearly as well.
void check_unique(const std::vector<Candidate>& found, std::size_t sights, double noise_px) {
  constexpr double kSame_rad = 0.01;
  constexpr double kFactor_100 = 9.2;  // 2 ln 100: a pose that is a hundred times less likely is ignored
  for (const Candidate& other : found) {
    const double apart = geodesic_angle_rad(other.pose.rotation, found.front().pose.rotation);
    if (apart < kSame_rad || other.squares_px - found.front().squares_px > kFactor_100 * noise_px * noise_px) continue;
    const auto rms = [&](const Candidate& one) { return short_number(std::sqrt(one.squares_px / double(sights))); };
    throw Error(
        formatted("two poses explain the landmarks: they differ by {:.3g} degrees, and leave {} and {} px. In one "
                  "view, points that lie nearly in a plane look the same tilted to either side; add a view, or a "
                  "landmark that lies off that plane",
                  degrees(apart), rms(found.front()), rms(other)));
  }
}

std::string residual_warning(const std::vector<Sight>& sights, const Pose& pose, double noise_px) {
  const Sight* worst = nullptr;
  double largest = 0;
  for (const Sight& sight : sights) {
    const double off = (project(*sight.camera, pose.world_from_model * sight.model_mm) - sight.pixel).norm();
    if (worst && off < largest) continue;
    worst = &sight;
    largest = off;
  }
  return formatted(
      "the landmarks are {:.3g} px away from where this pose shows them ('{}' in view '{}' {:.3g} px), but {:.3g} px "
      "were expected; are two names exchanged, or is a camera wrong?",
      pose.cost, worst->name, worst->view, largest, noise_px);
}

Pose landmarks(const Mesh& model, const Landmarks& landmarks, const List<View>& views, const Options& options,
               Context& context) {
  check_mesh(model, "model");
  const std::vector<Sight> sights = sights_of(landmarks, views, context);
  check_enough(sights);
  Pose pose;
  pose.frame = fragment_frame(model);
  const std::vector<Candidate> found = minima(sights, pose.frame);
  if (found.empty())
    throw Error(
        "no pose was found for the landmarks: no view shows three of them, and no three are seen in two views; mark "
        "more of them");
  check_unique(found, sights.size(), options.noise_px);
  pose.world_from_model = found.front().pose;
  pose.world_from_model.source = model.frame;
  pose.cost = std::sqrt(found.front().squares_px / double(sights.size()));
  pose.covariance = options.noise_px * options.noise_px *
                    inverse_of_symmetric(normal_at(sights, pose.world_from_model, pose.frame).curvature);
  if (pose.cost > 3 * options.noise_px) {
    pose.warnings.push_back(residual_warning(sights, pose, options.noise_px));
    context.warn(pose.warnings.back());
  }
  return pose;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("initial.landmarks", landmarks)
      .summary(
          "Pose with the least reprojection error of marked landmarks, over all views at once, with its predicted "
          "error")
      .in("model", "surface of the fragment; it gives the axes")
      .in("landmarks", "points in the CT and their marked pixels in the views")
      .in("views", "X-ray views; only their cameras are used", over("view"))
      .out("pose", "pose of least reprojection error; its cost is the root mean square of this error in pixels")
      .option("noise_px", &Options::noise_px,
              "expected standard deviation of each coordinate of a marked landmark; used for the covariance, for the "
              "warning, and to decide whether a second pose is possible too",
              at_least(1e-3));
}
