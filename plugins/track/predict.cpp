// SPDX-License-Identifier: Apache-2.0
#include <marrow/plugin.hpp>

#include "marrow/toolbox/track/motion_model.hpp"

namespace {

using namespace marrow;
using track::AutoscoperTrack;
using track::TrackState;

struct Options {
  double keyframe_deg = 3;
  double keyframe_mm = 3;
  double keyframe_speed_deg_s = 100;
  double keyframe_speed_mm_s = 200;
};

struct Prediction {
  TrackState state;
  Pose pose;
};

/// The keyframe of the frame whose number, from 0 on, is that of the state.
const RigidTransform* keyframe_of(const AutoscoperTrack* keyframes, int frame) {
  if (!keyframes || keyframes->world_from_bone.empty()) return nullptr;
  const std::size_t at = std::size_t(frame), count = keyframes->world_from_bone.size();
  if (at >= count)
    throw Error(
        formatted("there are keyframes for {} frames, but this is frame {}; give a line for each frame, with NaN where "
                  "there is no keyframe",
                  count, at + 1));
  return keyframes->world_from_bone[at] ? &*keyframes->world_from_bone[at] : nullptr;
}

/// Puts the bone where a person placed it. The usual cost, covariance and noise of poses are estimated again, because
/// the earlier frames may have followed something else. Their velocity is kept only if it led to the keyframe.
void begin_again_at(const RigidTransform& keyframe, TrackState& state, const Options& options) {
  check_rigid(keyframe, "the keyframe");
  constexpr double kMostSurprise = 22.46;  // 0.1 % of right poses are farther off: chi-squared, 6 degrees of freedom
  track::Vector12d deviation;
  deviation << Eigen::Vector3d::Constant(radians(options.keyframe_deg)), Eigen::Vector3d::Constant(options.keyframe_mm),
      Eigen::Vector3d::Constant(radians(options.keyframe_speed_deg_s)),
      Eigen::Vector3d::Constant(options.keyframe_speed_mm_s);
  const track::Matrix12d covariance = deviation.cwiseAbs2().asDiagonal();
  if (track::surprise(state, {keyframe, covariance.topLeftCorner<6, 6>()}) > kMostSurprise)
    state.predicted.velocity_per_s.setZero();
  state.predicted.world_from_model = keyframe;
  state.predicted.covariance = covariance;
  state.now = state.predicted;
  const TrackState fresh;
  state.usual_cost = fresh.usual_cost;
  state.usual_covariance = fresh.usual_covariance;
  state.noise_scale = fresh.noise_scale;
}

Prediction predict(const TrackState& before, const AutoscoperTrack* keyframes, const Options& options) {
  TrackState state = track::predicted(before);
  if (const RigidTransform* keyframe = keyframe_of(keyframes, state.frame)) begin_again_at(*keyframe, state, options);
  return {state, track::pose_of(state)};
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("track.predict", predict)
      .summary("Where the bone is in the next frame, if it keeps its velocity, or where a keyframe says")
      .in("state", "what is known after the frame before")
      .in("keyframes", "poses that a person placed in some frames; they take the place of the prediction there")
      .out("state", &Prediction::state, "what is known before the frame is registered")
      .out("pose", &Prediction::pose, "predicted pose with its covariance, to start the frame's registration from")
      .option("keyframe_deg", &Options::keyframe_deg, "standard deviation of a keyframe's rotations", at_least(1e-6))
      .option("keyframe_mm", &Options::keyframe_mm, "standard deviation of a keyframe's translations", at_least(1e-6))
      .option("keyframe_speed_deg_s", &Options::keyframe_speed_deg_s,
              "standard deviation of the angular velocity at a keyframe", at_least(1e-6), unit("deg/s"))
      .option("keyframe_speed_mm_s", &Options::keyframe_speed_mm_s, "standard deviation of the velocity at a keyframe",
              at_least(1e-6), unit("mm/s"));
}
