// SPDX-License-Identifier: Apache-2.0
#include <marrow/plugin.hpp>

#include "marrow/toolbox/geometry/fragments.hpp"
#include "marrow/toolbox/track/track_state.hpp"

namespace {

using namespace marrow;
using track::TrackState, track::Trajectory;

Trajectory way(const List<Pose>& poses, const Mesh* model, const Context& context) {
  Trajectory result;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    check_pose(poses[i], "the pose of " + poses.name(i));
    const Pose pose = geometry::with_fragment_axes(poses[i], model, context);
    TrackState state;
    state.frame = int(i);
    state.frame_rate_hz = 1;
    state.fragment = pose.frame;
    state.now.world_from_model = pose.world_from_model;
    if (pose.covariance) {
      state.now.covariance.topLeftCorner<6, 6>() = *pose.covariance;
      state.measured = track::Measurement{pose.world_from_model, *pose.covariance};
    } else {
      state.note = "it has no deviations";
    }
    state.predicted = state.now;
    result.frames.push_back(poses.name(i));
    result.states.push_back(state);
  }
  return result;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("guide.way", way)
      .summary("The way of a fragment from pair to pair of images, for the report; one second stands for one pair")
      .in("poses", "pose of the fragment in each pair", over("pass"))
      .in("model", "surface of the fragment: it gives the axes of poses that have none")
      .out("trajectory", "the poses with their deviations");
}
