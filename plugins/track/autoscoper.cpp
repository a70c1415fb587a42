// SPDX-License-Identifier: Apache-2.0
// A bone's poses for Autoscoper: a line a frame, the 16 numbers of the 4x4 matrix world from bone row by row, in mm,
// and NaN for a frame in which the bone is lost.
#include <cstdio>
#include <marrow/plugin.hpp>

#include "marrow/toolbox/files/atomic_write.hpp"
#include "marrow/toolbox/track/track_state.hpp"

namespace {

using namespace marrow;
using track::AutoscoperTrack;
using track::TrackState;

AutoscoperTrack autoscoper(const List<TrackState>& states) {
  AutoscoperTrack result;
  for (const TrackState& state : states)
    result.world_from_bone.push_back(state.is_found() ? std::optional(state.now.world_from_model) : std::nullopt);
  return result;
}

void write_tra(const AutoscoperTrack& track, const std::string& path) {
  std::string text;
  for (const auto& pose : track.world_from_bone) {
    for (int row = 0; row < 4; ++row)
      for (int column = 0; column < 4; ++column) {
        char number[40] = "NaN";
        const double value = !pose        ? 0
                             : row == 3   ? double(column == 3)
                             : column < 3 ? pose->rotation(row, column)
                                          : pose->translation_mm[row];
        if (pose) std::snprintf(number, sizeof number, "%.17g", value);
        text += (row + column > 0 ? "," : "") + std::string(number);
      }
    text += "\n";
  }
  files::write_text(path, text);
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("track.autoscoper", autoscoper)
      .summary("A bone's poses in the format of Autoscoper (.tra)")
      .in("states", "what is known after each frame", over("frame"))
      .out("track", "poses of the frames in which the bone was found");
  plugin.writer<AutoscoperTrack>(".tra", write_tra,
                                 "Autoscoper's format: a line a frame, a 4x4 matrix in mm, row by row");
}
