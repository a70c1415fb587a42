// SPDX-License-Identifier: Apache-2.0
#include "marrow/initial/evidence.hpp"

#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <numeric>

#include "marrow/initial/moved_outline.hpp"
#include "marrow/initial/seen_space.hpp"

namespace marrow::initial {

Evidence::Evidence(const Seen& seen, const Eigen::Vector3d& middle_mm, double cell_mm)
    : seen_(seen), middle_mm_(middle_mm) {
  for (std::size_t view = 0; view < seen.views.size(); ++view)
    scores_.emplace_back(seen.views[view], seen.edges[view],
                         cell_mm / pixel_size_at_mm(seen.views[view].camera, middle_mm));
}

double Evidence::of(const RigidTransform& world_from_model) const {
  double sum = 0;
  for (std::size_t view = 0; view < scores_.size(); ++view) {
    const EdgeScores& scores = scores_[view];
    for (const OutlinePoint& point :
         seen_.projector.outline(seen_.views[view].camera, world_from_model, scores.cell_px()))
      sum += scores.at(point.u_px, point.v_px, point.normal_u, point.normal_v);
  }
  return sum;
}

std::vector<RigidTransform> Evidence::best(const std::vector<RigidTransform>& poses, std::size_t count) const {
  std::vector<double> values(poses.size());
  tbb::parallel_for(std::size_t(0), poses.size(), [&](std::size_t i) { values[i] = of(poses[i]); });
  std::vector<std::size_t> order(poses.size());
  std::iota(order.begin(), order.end(), std::size_t(0));
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return values[a] > values[b]; });
  order.resize(std::min(order.size(), count));
  std::vector<RigidTransform> best;
  for (const std::size_t i : order) best.push_back(poses[i]);
  return best;
}

namespace {

RigidTransform motion_about(const Eigen::Vector3d& pivot_mm, const Eigen::Matrix3d& turn) {
  return {"world", "world", turn, pivot_mm - turn * pivot_mm};
}

}  // namespace

struct Evidence::Climber {
  explicit Climber(const Evidence& evidence) : axes(evidence.seen_.views[0].camera.camera_from_world.rotation) {
    axes.transposeInPlace();
    for (std::size_t view = 0; view < evidence.scores_.size(); ++view)
      outlines.emplace_back(evidence.seen_.projector, evidence.seen_.views[view].camera, evidence.scores_[view]);
  }

  void draw(const RigidTransform& pose) {
    for (MovedOutline& outline : outlines) outline.draw(pose);
  }
  int after(const RigidTransform& motion) const {
    int sum = 0;
    for (const MovedOutline& outline : outlines) sum += outline.score_after(motion);
    return sum;
  }

  /// The moves of one round, one after the other: each that gives more evidence counts.
  RigidTransform round(const Eigen::Vector3d& pivot_mm, double step_deg, double step_mm) const {
    RigidTransform best = motion_about(pivot_mm, Eigen::Matrix3d::Identity());
    int most = after(best);
    for (int axis = 0; axis < 6; ++axis)
      for (const double sense : {1.0, -1.0}) {
        const Eigen::Vector3d direction = sense * axes.col(axis % 3);
        RigidTransform moved = best;
        if (axis < 3)
          moved = best * motion_about(pivot_mm, rotation_from_vector(radians(step_deg) * direction));
        else
          moved.translation_mm += step_mm * direction;
        const int value = after(moved);
        if (value <= most) continue;
        most = value, best = moved;
        break;
      }
    return best;
  }

  /// After the moves of each round, the outline is drawn anew.
  RigidTransform climbed(RigidTransform pose, const Eigen::Vector3d& pivot_mm, double step_deg, double step_mm) {
    constexpr int kRounds = 2;
    const RigidTransform stay = motion_about(pivot_mm, Eigen::Matrix3d::Identity());
    draw(pose);
    int most = after(stay);
    for (int round_number = 0; round_number < kRounds; ++round_number) {
      const RigidTransform moved = round(pivot_mm, step_deg, step_mm) * pose;
      draw(moved);
      const int value = after(stay);
      if (value <= most) break;
      most = value, pose = moved;
    }
    return pose;
  }

  Eigen::Matrix3d axes;  ///< of the first camera, in the world
  std::vector<MovedOutline> outlines;
};

void Evidence::climb(std::vector<RigidTransform>& poses, const Eigen::Vector3d& model_middle_mm, double step_deg,
                     double step_mm) const {
  tbb::parallel_for(std::size_t(0), poses.size(), [&](std::size_t i) {
    const Eigen::Vector3d at_mm = poses[i] * model_middle_mm;
    bool is_in_view = true;
    for (const View& view : seen_.views) is_in_view = is_in_view && is_seen(view.camera, at_mm);
    poses[i] = Climber(*this).climbed(poses[i], is_in_view ? at_mm : middle_mm_, step_deg, step_mm);
  });
}

}  // namespace marrow::initial
