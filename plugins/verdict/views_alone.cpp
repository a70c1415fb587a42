// SPDX-License-Identifier: Apache-2.0
// Where each view alone would move the bone. Every view agrees with the right pose; the views of a wrong pose, of a
// wrong camera or of another bone each pull in another direction.
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "judged.hpp"
#include "marrow/toolbox/match/views_cost.hpp"

namespace marrow::verdict {
namespace {

/// The pose after a motion in the plane of a view's image: a turn about the line of sight through the bone, and shifts
/// along the image's axes.
RigidTransform moved_in_view(const Judged& judged, const Camera& camera, const Eigen::Vector3d& deg_and_mm) {
  const RigidTransform& pose = judged.pose.world_from_model;
  const Eigen::Matrix3d world_from_camera = camera.camera_from_world.rotation.transpose();
  const Eigen::Vector3d centre = pose * judged.frame.origin_mm;
  const Eigen::Matrix3d turn = rotation_from_vector(world_from_camera.col(2) * radians(deg_and_mm[0]));
  RigidTransform result = pose;
  result.rotation = turn * pose.rotation;
  result.translation_mm = turn * (pose.translation_mm - centre) + centre + world_from_camera.col(0) * deg_and_mm[1] +
                          world_from_camera.col(1) * deg_and_mm[2];
  return result;
}

/// The quadratic model of the cost in a view, for motions as moved_in_view() takes them, after one of them.
MinimisationProblem::Expansion in_view_coordinates(const Judged& judged, const Camera& camera,
                                                   const RigidTransform& pose,
                                                   const std::optional<match::ViewsCost::ViewExpansion>& about) {
  if (!about) return {std::numeric_limits<double>::quiet_NaN(), {}, {}};
  const Eigen::Matrix3d frame_from_camera =
      (camera.camera_from_world.rotation * pose.rotation * judged.frame.axes).transpose();
  Eigen::Matrix<double, 6, 3> motion = Eigen::Matrix<double, 6, 3>::Zero();
  motion.col(0).head<3>() = radians(1) * frame_from_camera.col(2);
  motion.col(1).tail<3>() = frame_from_camera.col(0);
  motion.col(2).tail<3>() = frame_from_camera.col(1);
  return {about->whole.value, motion.transpose() * about->whole.gradient,
          motion.transpose() * about->whole.curvature * motion};
}

/// How far the view would move the bone in its image: mTRE.
double pull_mm(const Judged& judged, const Cost& cost, std::size_t view, const Camera& camera) {
  judged.context->check_cancelled();
  MinimisationProblem problem;
  problem.function = [&](const Eigen::VectorXd& x) {
    return cost.value_in_view(view, moved_in_view(judged, camera, Eigen::Vector3d(x)));
  };
  const auto* in_views = dynamic_cast<const match::ViewsCost*>(&cost);
  if (in_views && in_views->expansion_in_view(view, judged.pose.world_from_model, judged.frame))
    problem.expansion = [&](const Eigen::VectorXd& x) {
      const RigidTransform there = moved_in_view(judged, camera, Eigen::Vector3d(x));
      return in_view_coordinates(judged, camera, there, in_views->expansion_in_view(view, there, judged.frame));
    };
  problem.start = Eigen::VectorXd::Zero(3);
  problem.initial_step = Eigen::VectorXd::Constant(3, 1);
  problem.max_evaluations = 60;
  problem.step_tolerance = 0.03;
  return judged.off_mm(moved_in_view(judged, camera, Eigen::Vector3d(judged.optimizer->minimise(problem).x)));
}

/// How far the view would rotate the bone about its long axis, up to 16 degrees.
double pull_deg(const Judged& judged, const Cost& cost, std::size_t view) {
  constexpr int kSide = 8;
  constexpr double kStep_deg = 2;
  std::vector<double> values(2 * kSide + 1);
  tbb::parallel_for(0, 2 * kSide + 1, [&](int i) {
    Vector6d motion = Vector6d::Zero();
    motion[2] = kStep_deg * (i - kSide);
    values[std::size_t(i)] = cost.value_in_view(view, judged.moved_by(judged.pose.world_from_model, motion));
  });
  const int best = int(std::min_element(values.begin(), values.end()) - values.begin());
  double between = 0;
  if (best > 0 && best < 2 * kSide) {
    const double before = values[std::size_t(best - 1)], here = values[std::size_t(best)],
                 after = values[std::size_t(best + 1)], curvature = before - 2 * here + after;
    if (curvature > 0) between = 0.5 * (before - after) / curvature;
  }
  return std::abs(best - kSide + between) * kStep_deg;
}

}  // namespace

Evidence views_alone(const Judged& judged, const Cost& cost, const List<View>& views, const std::string& prefix) {
  if (cost.view_count() != views.size() || views.size() < 2) return {};
  std::vector<double> pulls_mm(views.size()), pulls_deg(views.size());
  tbb::parallel_for(std::size_t(0), views.size(), [&](std::size_t i) {
    pulls_mm[i] = pull_mm(judged, cost, i, views[i].camera);
    pulls_deg[i] = pull_deg(judged, cost, i);
  });
  const auto most = [](const std::vector<double>& of) { return *std::max_element(of.begin(), of.end()); };
  return {{prefix + "view_pull_mm", most(pulls_mm), "mm"}, {prefix + "view_pull_deg", most(pulls_deg), "deg"}};
}

}  // namespace marrow::verdict
