// SPDX-License-Identifier: Apache-2.0
// A bone's poses for Autoscoper. A frame in which the bone is lost has none.
#include <marrow/plugin.hpp>

#include "marrow/toolbox/files/atomic_write.hpp"
#include "marrow/toolbox/track/tra_file.hpp"

namespace {

using namespace marrow;
using track::AutoscoperTrack;
using track::TrackState;

AutoscoperTrack autoscoper(const List<TrackState>& states, const Volume* volume) {
  AutoscoperTrack result;
  for (const TrackState& state : states) {
    auto& pose = result.world_from_bone.emplace_back();
    if (!state.is_found()) continue;
    pose = state.now.world_from_model;
    if (volume) pose = track::world_from_autoscoper(*pose, volume->grid);
  }
  return result;
}

void write_tra(const AutoscoperTrack& track, const std::string& path) {
  files::write_text(path, track::tra_text(track));
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("track.autoscoper", autoscoper)
      .summary("A bone's poses in the format of Autoscoper (.tra)")
      .in("states", "what is known after each frame", over("frame"))
      .in("volume",
          "the bone's volume as Autoscoper has it (its VolumeFile, with its flips): the poses are then those of "
          "Autoscoper's own coordinates of the bone; none: of the model's")
      .out("track", "poses of the frames in which the bone was found");
  plugin.writer<AutoscoperTrack>(".tra", write_tra,
                                 "Autoscoper's format: one line per frame, with a 4x4 matrix in mm, row by row");
}
