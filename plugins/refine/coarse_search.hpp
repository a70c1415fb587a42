// SPDX-License-Identifier: Apache-2.0
#pragma once
// Where a view whose camera may be far off shows the bones. A refinement only finds the way from near the right place,
// so each view is searched alone: shifts on a grid, then Levenberg-Marquardt steps from the best of them.
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numeric>
#include <utility>
#include <vector>

#include "sight.hpp"

namespace marrow::refine {

/// Whether a camera may show the bones farther from their place than this, by one standard deviation along u or v.
inline bool may_be_farther_off(const List<View>& views, const std::vector<Sight>& sights, double reach_px) {
  for (std::size_t v = 0; v < views.size(); ++v)
    if (sights[v].deviation().segment<2>(3).maxCoeff() >
        reach_px * pixel_size_at_mm(views[v].camera, sights[v].centre_mm))
      return true;
  return false;
}

/// Searches one view. Refers to all that it is given.
class CoarseSearch {
 public:
  CoarseSearch(const List<Cost>& costs, const List<Pose>& poses, const List<View>& views, std::size_t view,
               const Sight& sight)
      : costs_(costs), poses_(poses), views_(views), view_(view), sight_(sight) {
    // The poses were found with these cameras, so they are off, too.
    Matrix6d expected = sight.covariance;
    expected.diagonal().head<3>().array() += kTurn_deg * kTurn_deg;
    information_ = inverse_of_symmetric(expected);
  }

  /// The motion of the camera with which its image shows the bones best; `reach_px` is that of the refinement to come.
  Vector6d best_motion(double reach_px, Context& context) const {
    Vector6d best = Vector6d::Zero();
    double least = INFINITY;
    for (Vector6d motion : promising(context)) {
      double value = 0;
      for (double reach = kReach_px; reach >= std::min(reach_px, kReach_px); reach *= 0.5)
        value = descend(motion, level({kSpacing_px / 2, reach, 4}), context);
      if (value < least) least = value, best = motion;
    }
    return best;
  }

 private:
  static constexpr double kReach_px = 24;   ///< an outline's point with no edge within this distance is unmatched
  static constexpr double kSpacing_px = 8;  ///< of the outline's points on the grid
  static constexpr double kTurn_deg = 4;    ///< how far a pose may be turned
  static constexpr std::size_t kCandidates = 6;
  using Levels = std::vector<std::shared_ptr<const Cost>>;

  Levels level(const CostLevel& level) const {
    Levels levels;
    for (const Cost& cost : costs_) levels.push_back(cost.at_level(level));
    return levels;
  }
  double value(const Levels& levels, const Vector6d& motion) const {
    const RigidTransform moved = sight_.motion(motion);
    double sum = 0;
    for (std::size_t f = 0; f < levels.size(); ++f)
      sum += levels[f]->value_in_view(view_, moved * poses_[f].world_from_model);
    return sum;
  }

  /// The best shifts of the grid that are better than their neighbours. The grid covers 2.5 standard deviations to each
  /// side: across in steps of two thirds of the reach, along the depth in steps that change the bones' size by 3 %.
  /// Each shift comes with the rotation that is most probable with it.
  std::vector<Vector6d> promising(Context& context) const {
    const Camera& camera = views_[view_].camera;
    const double across_mm = 2 / 3.0 * kReach_px * pixel_size_at_mm(camera, sight_.centre_mm),
                 depth_mm = 0.03 * (camera.camera_from_world * sight_.centre_mm).z();
    const Eigen::Vector3d steps(across_mm, across_mm, depth_mm);
    Eigen::Vector3i most;
    for (int i = 0; i < 3; ++i)
      most[i] = std::clamp(int(std::ceil(2.5 * sight_.deviation()[3 + i] / steps[i] - 0.5)), 1, 15);
    const Eigen::Vector3i sides = 2 * most.array() + 1;
    const Matrix6d& information = information_;
    const Eigen::Matrix3d rotation_by_shift =
        -information.topLeftCorner<3, 3>().inverse() * information.topRightCorner<3, 3>();
    const auto motion_at = [&](int i) {
      const Eigen::Vector3i place(i % sides[0], i / sides[0] % sides[1], i / sides[0] / sides[1]);
      const Eigen::Vector3d shift = (place - most).cast<double>().cwiseProduct(steps);
      Vector6d motion;
      motion << rotation_by_shift * shift, shift;
      return motion;
    };
    const Levels levels = level({kSpacing_px, kReach_px, 8});
    std::vector<double> values(std::size_t(sides.prod()));
    tbb::parallel_for(std::size_t(0), values.size(), [&](std::size_t i) {
      context.check_cancelled();
      values[i] = value(levels, motion_at(int(i)));
    });
    return least_of_neighbours(values, sides, motion_at);
  }

  template <class MotionAt>
  static std::vector<Vector6d> least_of_neighbours(const std::vector<double>& values, const Eigen::Vector3i& sides,
                                                   const MotionAt& motion_at) {
    const auto is_least = [&](int i) {
      const Eigen::Vector3i place(i % sides[0], i / sides[0] % sides[1], i / sides[0] / sides[1]);
      for (int n = 0; n < 27; ++n) {
        const Eigen::Vector3i other = place + Eigen::Vector3i(n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1);
        if ((other.array() < 0).any() || (other.array() >= sides.array()).any()) continue;
        const int at = (other[2] * sides[1] + other[1]) * sides[0] + other[0];
        if (std::pair(values[std::size_t(at)], at) < std::pair(values[std::size_t(i)], i)) return false;
      }
      return true;
    };
    std::vector<int> least;
    for (int i = 0; i < sides.prod(); ++i)
      if (is_least(i)) least.push_back(i);
    std::stable_sort(least.begin(), least.end(),
                     [&](int a, int b) { return values[std::size_t(a)] < values[std::size_t(b)]; });
    least.resize(std::min(least.size(), kCandidates));
    std::vector<Vector6d> motions;
    for (const int i : least) motions.push_back(motion_at(i));
    return motions;
  }

  /// Goes to the minimum nearby, and returns the cost there. What is expected counts a little, so that a motion that
  /// the image does not tell stays small.
  double descend(Vector6d& motion, const Levels& levels, Context& context) const {
    constexpr int kMostSteps = 12;
    std::vector<BoneInView> bones;
    for (std::size_t f = 0; f < levels.size(); ++f) bones.emplace_back(*levels[f], poses_[f].frame, view_, views_);
    double here = value(levels, motion);
    const Matrix6d prior = 0.01 * here * information_;
    for (int i = 0; i < kMostSteps; ++i) {
      context.check_cancelled();
      Matrix6d a = prior;
      Vector6d b = prior * motion;
      for (std::size_t f = 0; f < bones.size(); ++f) {
        const RigidTransform seen = sight_.motion(motion) * poses_[f].world_from_model;
        const Model model = bones[f].model_at(seen, 0.05 * here, false);
        const Matrix6d change = sight_.of_bone(seen, poses_[f].frame);
        a += change.transpose() * model.curvature * change;
        b += change.transpose() * model.gradient;
      }
      const auto energy = [&](double cost, const Vector6d& at) { return cost + 0.5 * at.dot(prior * at); };
      const double before = energy(here, motion);
      double gain = 0;
      for (double damping = 1e-3; damping < 1e3 && !(gain > 0); damping *= 10) {
        Matrix6d damped = a;
        damped.diagonal() *= 1 + damping;
        const Vector6d next = motion - inverse_of_symmetric(damped) * b;
        const double there = value(levels, next);
        gain = before - energy(there, next);
        if (gain > 0) motion = next, here = there;
      }
      if (!(gain > 1e-3 * before)) break;
    }
    return here;
  }

  const List<Cost>& costs_;
  const List<Pose>& poses_;
  const List<View>& views_;
  const std::size_t view_;
  const Sight& sight_;
  Matrix6d information_;  ///< the inverse covariance of the motions that are searched for
};

}  // namespace marrow::refine
