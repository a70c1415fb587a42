// SPDX-License-Identifier: Apache-2.0
// Keyframes: poses that a person placed in some frames of a sequence.
#include <algorithm>
#include <map>
#include <marrow/plugin.hpp>

#include "marrow/toolbox/files/input_file.hpp"
#include "marrow/toolbox/track/tra_file.hpp"

namespace {

namespace fs = std::filesystem;

using namespace marrow;
using track::AutoscoperTrack;
using track::SequenceFrame;

struct Options {
  fs::path path;
};

/// The files of the folder by the name of their bone.
std::map<std::string, fs::path> files_by_bone(const fs::path& folder, const std::vector<std::string>& bones) {
  std::error_code failure;
  if (!fs::is_directory(folder, failure))
    throw Error(folder.string() + ": expected a folder with a file BONE.tra for each bone that has keyframes" +
                (fs::exists(folder, failure) ? " (name the folder, not a file in it)" : "; there is no such folder"));
  std::string known;
  for (const std::string& bone : bones) known += (known.empty() ? "'" : ", '") + bone + "'";
  std::map<std::string, fs::path> files;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder))
    if (entry.path().extension() == ".tra") files[files::unescaped_name(entry.path().stem().string())] = entry.path();
  for (const auto& [name, file] : files)
    if (std::find(bones.begin(), bones.end(), name) == bones.end())
      throw Error(file.string() + ": no bone of this name is followed; name the file after its bone, which is one of " +
                  known);
  if (files.empty())
    throw Error(folder.string() +
                ": there is no .tra file in it; a file of keyframes is named after its bone, one of " + known);
  return files;
}

List<AutoscoperTrack> keyframes(const List<Pose>& bones, const List<SequenceFrame>* frames, const Options& options) {
  std::map<std::string, fs::path> files;
  if (!options.path.empty()) files = files_by_bone(options.path, bones.names());
  List<AutoscoperTrack> result;
  for (const std::string& bone : bones.names()) {
    AutoscoperTrack track;
    if (const auto file = files.find(bone); file != files.end()) {
      track = track::read_tra_file(file->second);
      if (frames && track.world_from_bone.size() != frames->size())
        throw Error(
            formatted("{}: has {} lines, but the sequence has {} frames; it needs a line for each frame that is read, "
                      "with NaN where there is no keyframe",
                      file->second.string(), track.world_from_bone.size(), frames->size()));
    }
    result.add(bone, std::move(track));
  }
  return result;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("track.keyframes", keyframes)
      .summary("Poses that a person placed in some frames, from files of Autoscoper (.tra)")
      .in("poses", "a pose of each bone that is followed; only their names are used", over("fragment"))
      .in("frames", "the sequence, to see whether the files have a line for each frame", over("frame"))
      .out("keyframes", "the keyframes of each bone; none for a bone without a file", over("fragment"))
      .option("path", &Options::path,
              "folder with a file BONE.tra for each bone that has keyframes: one line per frame, NaN if it has no "
              "keyframe; empty: there are no keyframes");
}
