// SPDX-License-Identifier: Apache-2.0
#include "marrow/initial/evidence.hpp"

#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <numeric>

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
      sum += scores.at(point);
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

RigidTransform Evidence::climbed(const RigidTransform& pose, const Eigen::Vector3d& pivot_mm, double step_deg,
                                 double step_mm) const {
  constexpr int kRounds = 2;
  const Eigen::Matrix3d axes = seen_.views[0].camera.camera_from_world.rotation.transpose();
  RigidTransform best = pose;
  double most = of(pose);
  for (int round = 0; round < kRounds; ++round)
    for (int axis = 0; axis < 6; ++axis)
      for (const double sense : {1.0, -1.0}) {
        const Eigen::Vector3d direction = sense * axes.col(axis % 3);
        RigidTransform moved = best;
        if (axis < 3) {
          const Eigen::Matrix3d turn = rotation_from_vector(radians(step_deg) * direction);
          moved.rotation = turn * best.rotation;
          moved.translation_mm = pivot_mm + turn * (best.translation_mm - pivot_mm);
        } else {
          moved.translation_mm += step_mm * direction;
        }
        const double value = of(moved);
        if (value <= most) continue;
        most = value, best = moved;
        break;
      }
  return best;
}

void Evidence::climb(std::vector<RigidTransform>& poses, const Eigen::Vector3d& model_middle_mm, double step_deg,
                     double step_mm) const {
  tbb::parallel_for(std::size_t(0), poses.size(), [&](std::size_t i) {
    const Eigen::Vector3d at_mm = poses[i] * model_middle_mm;
    bool is_in_view = true;
    for (const View& view : seen_.views) is_in_view = is_in_view && is_seen(view.camera, at_mm);
    poses[i] = climbed(poses[i], is_in_view ? at_mm : middle_mm_, step_deg, step_mm);
  });
}

}  // namespace marrow::initial
