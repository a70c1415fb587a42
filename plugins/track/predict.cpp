// SPDX-License-Identifier: Apache-2.0
#include <marrow/plugin.hpp>

#include "marrow/toolbox/track/motion_model.hpp"

namespace {

using namespace marrow;
using track::TrackState;

struct Prediction {
  TrackState state;
  Pose pose;
};

Prediction predict(const TrackState& before) {
  const TrackState state = track::predicted(before);
  return {state, track::pose_of(state)};
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("track.predict", predict)
      .summary("Where the bone is in the next frame, if it keeps its velocity")
      .in("state", "what is known after the frame before")
      .out("state", &Prediction::state, "what is known before the frame is looked at")
      .out("pose", &Prediction::pose, "predicted pose with its covariance, to start the frame's registration from");
}
