// SPDX-License-Identifier: Apache-2.0
// An implant's poses from JointTrack. Its calibration is a camera file, so read.views and read.camera read that.
#include <marrow/plugin.hpp>

#include "marrow/toolbox/exchange/jointtrack.hpp"

namespace {

using namespace marrow;

struct Options {
  std::filesystem::path path;
  std::vector<std::string> radians;
  std::string rotation_axes = "y_up";
  int frame = 0;
};

struct Result {
  List<Pose> poses;
  std::optional<Pose> pose;
};

std::string units_of(const Options& options) {
  std::string text;
  for (const std::string& name : exchange::kJointTrackRotations)
    text += (text.empty() ? "" : ", ") + name +
            (std::count(options.radians.begin(), options.radians.end(), name) ? " in radians" : " in degrees");
  return text;
}

Result jointtrack(const Camera* camera, const Mesh* model, const Options& options, Context& context) {
  for (const std::string& name : options.radians)
    if (!std::count(exchange::kJointTrackRotations.begin(), exchange::kJointTrackRotations.end(), name))
      throw Error("radians: expected names of z_rot, x_rot and y_rot, got '" + name + "'");
  const exchange::JointTrackPoses read =
      exchange::read_jointtrack_poses(options.path, {options.radians, options.rotation_axes == "y_down"});
  context.info("rotations were taken as " + units_of(options));
  for (const std::string& doubt : read.doubts) context.warn(doubt);
  Result result;
  for (std::size_t i = 0; i < read.camera_from_model.size(); ++i) {
    if (!read.camera_from_model[i]) continue;
    Pose pose;
    RigidTransform camera_from_model = *read.camera_from_model[i];
    if (model) pose.frame = fragment_frame(*model), camera_from_model.source = model->frame;
    if (camera) {
      camera_from_model.target = camera->camera_from_world.target;
      pose.world_from_model = inverse(camera->camera_from_world) * camera_from_model;
    } else {
      camera_from_model.target = "world";
      pose.world_from_model = camera_from_model;
    }
    result.poses.add(formatted("{:04}", i + 1), pose);
    if (int(i) + 1 == options.frame) result.pose = pose;
  }
  if (options.frame > 0 && !result.pose)
    throw Error(formatted("{}: frame {} has no pose; the file has {} frames, of which {} have one",
                          options.path.string(), options.frame, read.camera_from_model.size(), result.poses.size()));
  return result;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("read.jointtrack", jointtrack)
      .summary(
          "Reads an implant's poses from JointTrack (.jts or .jtak); its calibration is read by read.views or "
          "read.camera")
      .in("camera", "camera of the poses; none: the source is the world's origin, as in a calibration of JointTrack")
      .in("model", "surface of the implant: it gives the poses its axes")
      .out("poses", &Result::poses, "poses of the frames that have one, named by their number, counted from 1",
           over("frame"))
      .out("pose", &Result::pose, "the pose of 'frame'; absent if that is 0")
      .option("path", &Options::path, "the file, one line per frame", required())
      .option("radians", &Options::radians,
              "which of z_rot, x_rot and y_rot are in radians; the others are in degrees. The file does not say its "
              "unit; numbers that look like the other one give a warning")
      .option(
          "rotation_axes", &Options::rotation_axes,
          "axes of the camera to which the rotations refer: y_up, as JointTrack writes them (z towards the source); "
          "or y_down, OpenCV's, as in the poses of JTML's biplane study; the shifts are y_up in both",
          one_of({"y_up", "y_down"}))
      .option("frame", &Options::frame, "number of the frame whose pose is wanted, counted from 1; 0: none alone",
              at_least(0));
}
