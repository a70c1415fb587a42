// SPDX-License-Identifier: Apache-2.0
#pragma once
// Bones that move with a known velocity, and measurements of them with known noise.
#include "marrow/domain/random.hpp"
#include "marrow/toolbox/track/motion_model.hpp"
#include "tests/harness/node_test.hpp"

namespace marrow::test::sequences {

using track::Measurement;
using track::TrackState;

inline Vector6d six(double r1, double r2, double r3, double t1, double t2, double t3) {
  Vector6d v;
  v << radians(r1), radians(r2), radians(r3), t1, t2, t3;
  return v;
}

/// The state before the first frame, of a bone somewhere.
inline TrackState begin(const Options& options = {}) {
  Pose pose;
  pose.world_from_model.rotation = rotation_from_vector({0.3, -0.2, 0.5});
  pose.world_from_model.translation_mm = {10, -20, 30};
  pose.frame.origin_mm = {5, 6, 70};
  pose.frame.axes = rotation_from_vector({0.1, 0.2, -0.3});
  return output<TrackState>("track.begin", "state", {{"start", item(pose)}}, options);
}

/// Poses of a bone that starts in `state` with this velocity, one for each frame.
inline std::vector<RigidTransform> way(const TrackState& state, const Vector6d& velocity_per_s, int frames) {
  std::vector<RigidTransform> poses{state.now.world_from_model};
  for (int i = 1; i < frames; ++i)
    poses.push_back(moved(poses.back(), state.fragment, velocity_per_s / state.frame_rate_hz));
  return poses;
}

inline Measurement measured(const RigidTransform& truth, const TrackState& state, const Vector6d& deviation,
                            Random& random) {
  Vector6d error;
  for (int i = 0; i < 6; ++i) error[i] = deviation[i] * random.normal();
  return {moved(truth, state.fragment, error), deviation.cwiseAbs2().asDiagonal()};
}

}  // namespace marrow::test::sequences
