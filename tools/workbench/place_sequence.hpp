// SPDX-License-Identifier: Apache-2.0
#pragma once
// Sequences on the page "Place": their frames, keyframes, and the tracking of the bones.
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "workbench/place.hpp"

namespace marrow::workbench {

/// Where the frames of a view are.
struct ViewFrames {
  std::string name;
  std::string images;   ///< relative to the opened folder: a folder, a file with several frames, or a video
  std::string pattern;  ///< which files of the folder; empty: all images
};

/// {VIEW: {images, pattern}} for each view of the case, in its order. Throws Error if one is missing.
std::vector<ViewFrames> frames_in(const nlohmann::json& views, const PlacedCase& placed);

/// The camera file of a view: the one that case.yaml names, or one with the camera in case.yaml.
std::filesystem::path camera_file_of(const Workbench& workbench, const PlacedCase& placed, const std::string& view);

/// The number of frames, which is the same in all views. Images of folders are not opened, except the first. Throws
/// Error if a view cannot be read, or if the views have different numbers of frames.
int count_frames(const Workbench& workbench, const PlacedCase& placed, const std::vector<ViewFrames>& views, Job& job);

/// A sequence, and the poses from which the bones are tracked through it.
struct TrackWish {
  std::vector<ViewFrames> views;
  double frame_rate_hz = 30;
  std::string placed;          ///< folder with BONE.yaml, relative to the opened folder
  bool has_keyframes = false;  ///< whether there are files BONE.tra in it
};

/// Writes the poses in the first frame as BONE.yaml, and the keyframes {BONE: {FRAME from 1: matrix}} as BONE.tra, into
/// a folder as write_placement() does. So that other sequences have other folders, `sequence` is written beside them.
/// Returns the folder's path relative to the opened folder.
std::string write_keyframes(const OpenedFolder& folder, const PlacedCase& placed,
                            const std::map<std::string, RigidTransform>& starts, const nlohmann::json& keyframes,
                            int frames, const nlohmann::json& sequence);

/// The command that does what track() does.
std::string command_to_track(const Workbench& workbench, const PlacedCase& placed, const TrackWish& wish);
/// Follows the bones, and writes their poses as BONE.tra into the folder `tracked` of `wish.placed`. {tracked: its
/// path, poses: {BONE: [matrix or null of each frame]}, verdicts: {BONE: [judgement of each frame]}}
nlohmann::json track(const Workbench& workbench, const PlacedCase& placed, const TrackWish& wish, Job& job);

/// The poses that track() wrote, {BONE: [matrix or null]}. Throws Error if one cannot be read.
nlohmann::json tracked_poses(const OpenedFolder& folder, const PlacedCase& placed, const std::string& tracked);

}  // namespace marrow::workbench
