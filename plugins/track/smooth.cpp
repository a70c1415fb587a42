// SPDX-License-Identifier: Apache-2.0
#include <marrow/plugin.hpp>

#include "marrow/toolbox/track/motion_model.hpp"

namespace {

using namespace marrow;
using track::TrackState;

struct Smoothed {
  List<TrackState> states;
  List<Pose> poses;
};

Smoothed smooth(const List<TrackState>& states) {
  std::vector<TrackState> all;
  for (const TrackState& state : states) all.push_back(state);
  all = track::smoothed(all);
  Smoothed result;
  for (std::size_t i = 0; i < all.size(); ++i) {
    result.states.add(states.name(i), all[i]);
    result.poses.add(states.name(i), track::pose_of(all[i]));
  }
  return result;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("track.smooth", smooth)
      .summary("The best pose of each frame from the frames before and after it (Rauch-Tung-Striebel smoother)")
      .in("states", "what the filter knew after each frame", over("frame"))
      .out("states", &Smoothed::states, "the same, smoothed", over("frame"))
      .out("poses", &Smoothed::poses, "smoothed poses with their covariances", over("frame"));
}
