// SPDX-License-Identifier: Apache-2.0
// An implant's poses and its camera for JointTrack.
#include <algorithm>
#include <marrow/plugin.hpp>

#include "marrow/toolbox/exchange/jointtrack.hpp"
#include "marrow/toolbox/exchange/written_files.hpp"

namespace {

using namespace marrow;
using exchange::JtakFile, exchange::JtsFile, exchange::JointTrackCameraFile;

struct Options {
  double pixel_mm = 0;
};

struct Result {
  JtsFile jts;
  JtakFile jtak;
  std::optional<JointTrackCameraFile> camera_file;
};

/// The line of each pose. Where all names are numbers from 1, as read.jointtrack gives them, they count; else the
/// order.
std::vector<std::size_t> lines_of(const List<Pose>& poses) {
  constexpr double kMostFrames = 1e6;
  std::vector<std::size_t> by_name, by_order;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    by_order.push_back(i);
    const auto number = parsed_number(poses.name(i));
    if (number && *number >= 1 && *number <= kMostFrames && *number == double(std::size_t(*number)))
      by_name.push_back(std::size_t(*number) - 1);
  }
  std::vector<std::size_t> sorted = by_name;
  std::sort(sorted.begin(), sorted.end());
  const bool is_unique = std::adjacent_find(sorted.begin(), sorted.end()) == sorted.end();
  return by_name.size() == poses.size() && is_unique ? by_name : by_order;
}

Result jointtrack(const List<Pose>& poses, const Camera* camera, const Options& options) {
  if (poses.empty()) throw Error("write.jointtrack: there is no pose to write");
  const std::vector<std::size_t> lines = lines_of(poses);
  std::vector<std::optional<RigidTransform>> camera_from_model(*std::max_element(lines.begin(), lines.end()) + 1);
  for (std::size_t i = 0; i < poses.size(); ++i) {
    check_rigid(poses[i].world_from_model, "the pose '" + poses.name(i) + "' cannot be written for JointTrack");
    camera_from_model[lines[i]] =
        camera ? camera->camera_from_world * poses[i].world_from_model : poses[i].world_from_model;
  }
  Result result{{exchange::jointtrack_poses(camera_from_model, "JT_EULER_312")},
                {exchange::jointtrack_poses(camera_from_model, "JTA_EULER_KINEMATICS")},
                std::nullopt};
  if (camera && options.pixel_mm > 0)
    result.camera_file = JointTrackCameraFile{exchange::jointtrack_camera(*camera, options.pixel_mm)};
  return result;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("write.jointtrack", jointtrack)
      .summary(
          "Gives an implant's poses and its camera for JointTrack (.jts, .jtak, calibration), rotations in degrees")
      .in("poses", "poses of the implant; names that are numbers say the frames, counted from 1", over("frame"))
      .in("camera", "camera to which JointTrack's poses refer; none: the source is the world's origin")
      .out("jts", &Result::jts, "the poses as JT_EULER_312; a frame without one is NOT_OPTIMIZED")
      .out("jtak", &Result::jtak, "the poses as JTA_EULER_KINEMATICS")
      .out("camera_file", &Result::camera_file, "the camera as JT_INTCALIB; only with a camera and pixel_mm")
      .option("pixel_mm", &Options::pixel_mm, "side of a pixel on the detector; 0: no calibration is given",
              at_least(0));
  plugin.writer<JtsFile>(".jts", exchange::write_file, "poses of JointTrack, in degrees");
  plugin.writer<JtakFile>(".jtak", exchange::write_file, "poses of JointTrack Machine Learning, in degrees");
  plugin.writer<JointTrackCameraFile>(".txt", exchange::write_file, "calibration of JointTrack");
}
