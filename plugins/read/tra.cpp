// SPDX-License-Identifier: Apache-2.0
// Reads a bone's poses from Autoscoper's format (.tra).
#include <marrow/plugin.hpp>

#include "marrow/toolbox/track/tra_file.hpp"

namespace {

using namespace marrow;
using track::AutoscoperTrack;

struct Options {
  std::filesystem::path path;
};

struct Tra {
  AutoscoperTrack track;
  List<Pose> poses;
};

Tra read_tra(const Volume* volume, const Options& options) {
  Tra result{track::read_tra_file(options.path), {}};
  if (volume)
    for (auto& pose : result.track.world_from_bone)
      if (pose) pose = track::world_from_volume(*pose, volume->grid);
  for (std::size_t i = 0; i < result.track.world_from_bone.size(); ++i) {
    if (!result.track.world_from_bone[i]) continue;
    Pose found;
    found.world_from_model = *result.track.world_from_bone[i];
    result.poses.add(track::frame_name(i + 1), found);
  }
  if (result.poses.empty()) throw Error(options.path.string() + ": there is no tracked frame in it");
  return result;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("read.tra", read_tra)
      .summary("Reads a bone's poses from a file of Autoscoper (.tra)")
      .in("volume",
          "the bone's volume as Autoscoper has it (its VolumeFile, with its flips): the poses are converted from "
          "Autoscoper's own coordinates of the bone to the volume's; none: they are kept, as track.autoscoper writes "
          "them without a volume")
      .out("track", &Tra::track, "the poses of all frames")
      .out("poses", &Tra::poses, "poses of the frames in which the bone was tracked, named by their number",
           over("frame"))
      .option("path", &Options::path, "the file, one line per frame", required());
}
