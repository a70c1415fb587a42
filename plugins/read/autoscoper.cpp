// SPDX-License-Identifier: Apache-2.0
// Reads one bone in one frame of a trial of Autoscoper (.cfg).
#include <marrow/plugin.hpp>

#include "marrow/base/diagnostics.hpp"
#include "marrow/read/camera_file.hpp"
#include "marrow/toolbox/exchange/autoscoper_trial.hpp"
#include "marrow/toolbox/files/input_file.hpp"
#include "marrow/toolbox/files/mesh_file.hpp"
#include "marrow/toolbox/files/sequence_files.hpp"
#include "marrow/toolbox/files/volume_file.hpp"
#include "marrow/toolbox/files/yaml_values.hpp"
#include "marrow/toolbox/track/tra_file.hpp"

namespace {

using namespace marrow;
namespace fs = std::filesystem;
using exchange::AutoscoperTrial, exchange::TrialPath, exchange::TrialVolume;

constexpr const char* kBone = "bone";  // as segment.threshold names the only bone

struct Options {
  fs::path path;
  std::string bone;
  std::string frame;
  fs::path start;
  double value_offset_hu = 0;
  double scale = 1;
};

struct Trial {
  Volume ct;
  List<View> views;
  List<Pose> start;
  List<Mesh> surface;
};

long long number_of_frame(const std::string& frame) {
  const std::optional<double> number = parsed_number(frame);
  if (!number || *number < 0 || *number != std::floor(*number) || *number > 1e15)
    throw Error("frame_name: expected the number in the names of its images, such as 0158 or 158, got '" + frame + "'");
  return (long long)*number;
}

/// Only the files in the trial's folder count in the key of the result (the trait names_files).
bool lies_in(const fs::path& folder, const fs::path& file) {
  std::error_code failure;
  const fs::path from_folder =
      fs::weakly_canonical(file, failure).lexically_relative(fs::weakly_canonical(folder, failure));
  return !from_folder.empty() && *from_folder.begin() != "..";
}

/// Notes every file and folder that is needed and is not there.
void check_files(const Options& options, const AutoscoperTrial& trial, const TrialVolume& volume) {
  Diagnostics faults;
  faults.remember(options.path.string(), files::read_text(options.path, 1 << 20));
  const auto check = [&](const TrialPath& named, bool is_folder) {
    std::error_code failure;
    const Place place{options.path.string(), named.line, 1};
    const std::string said = named.key + ": " + named.path.string();
    if (named.written.starts_with('/') && !fs::exists(named.path, failure))
      faults.add(place, said + " is not there", "a path from the trial's folder begins without a slash");
    else if (!fs::exists(named.path, failure))
      faults.add(place, said + " is not there");
    else if (fs::is_directory(named.path, failure) != is_folder)
      faults.add(place, said + (is_folder ? " is no folder" : " is a folder"));
    else if (!lies_in(fs::absolute(options.path).parent_path(), named.path))
      faults.add(place, said + " lies outside of the trial's folder", "put the trial into a folder that holds both");
  };
  for (const TrialPath& camera : trial.cameras) check(camera, false);
  for (const TrialPath& folder : trial.frame_folders) check(folder, true);
  check(volume.file, false);
  if (!volume.mesh.path.empty()) check(volume.mesh, false);
  if (!faults.empty()) throw Error(faults.text());
}

View read_view(const std::string& name, const fs::path& image, const fs::path& camera, const Options& options,
               Context& context) {
  read::ViewSource source{name, image, nullptr, camera, {}, {}};
  source.scale = options.scale;
  files::warn_of_pixels(image, context);
  return read::read_view_files(source, context).view;
}

/// The start in the file that `start` names. `position`: the frame's among all frames, from 0.
Pose read_start(const Options& options, const Grid& grid, std::size_t position) {
  Pose start;
  if (options.start.extension() != ".tra") {
    start.world_from_model = files::read_pose_file(options.start).world_from_model;
    return start;
  }
  const track::AutoscoperTrack track = track::read_tra_file(options.start);
  if (position >= track.world_from_bone.size() || !track.world_from_bone[position])
    throw Error(formatted("{}: has no pose in line {}, which is that of frame {}; track the bone there first",
                          options.start.string(), position + 1, options.frame));
  start.world_from_model = track::world_from_volume(*track.world_from_bone[position], grid);
  return start;
}

/// The surface of a MeshFile, in the coordinates of the volume.
Mesh read_surface(const fs::path& path, const Grid& grid) {
  Mesh mesh = files::read_marked_mesh(path).mesh;
  const RigidTransform volume_from_autoscoper = inverse(track::autoscoper_from_volume(grid));
  for (Eigen::Vector3d& vertex : mesh.vertices_mm) vertex = volume_from_autoscoper * vertex;
  mesh.frame = grid.frame;
  check_mesh(mesh, path.string());
  return mesh;
}

Trial read_trial(const Options& options, Context& context) {
  const AutoscoperTrial trial = exchange::read_autoscoper_trial(options.path);
  for (const std::string& remark : trial.unknown) context.warn(remark);
  const TrialVolume& volume = exchange::volume_of_bone(trial, options.bone, options.path.string());
  check_files(options, trial, volume);
  std::vector<files::NumberedFile> frames;
  for (const TrialPath& folder : trial.frame_folders)
    frames.push_back(files::numbered_file(folder.path, number_of_frame(options.frame)));

  Trial result;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const std::string name = formatted("camera{}", i + 1);
    result.views.add(name, read_view(name, frames[i].file, trial.cameras[i].path, options, context));
  }
  files::VolumeReading reading;
  reading.voxel_size_mm.assign(volume.voxel_size_mm.begin(), volume.voxel_size_mm.end());
  reading.flip = volume.flip;
  reading.value_offset_hu = options.value_offset_hu;
  result.ct = files::read_volume_file(volume.file.path, reading);
  files::warn_of_offset(result.ct, volume.file.path, options.value_offset_hu, context);
  if (!options.start.empty()) result.start.add(kBone, read_start(options, result.ct.grid, frames[0].position));
  if (!volume.mesh.path.empty()) result.surface.add(kBone, read_surface(volume.mesh.path, result.ct.grid));
  return result;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("read.autoscoper", read_trial)
      .summary("Reads one bone in one frame of a trial of Autoscoper (.cfg, versions 1.0 to 1.2)")
      .trait("names_files")
      .out("ct", &Trial::ct, "the bone's volume in Hounsfield units; its axes are columns, rows and pages")
      .out("views", &Trial::views, "the frame's image of each camera: camera1, camera2, ...", over("view"))
      .out("start", &Trial::start, "about where the bone is; none if no file is given", over("fragment"))
      .out("surface", &Trial::surface,
           "the bone's MeshFile in the coordinates of the volume; none if the trial has none", over("fragment"))
      .option("path", &Options::path, "file of the trial (.cfg); what it names lies in its folder or below", required())
      .option(
          "bone", &Options::bone,
          "name of the bone's VolumeFile without its ending, or a part of it that no other has; empty: the only one")
      .option("frame_name", &Options::frame, "number in the names of the frame's images, such as 0158 or 158",
              required())
      .option("start_file", &Options::start,
              "about where the bone is. .tra: Autoscoper's track of this bone, of which the line of this frame counts; "
              "any other: a pose file of marrow, in the coordinates of the volume")
      .option("value_offset_hu", &Options::value_offset_hu,
              "value added to every sample: -1024 if the volume holds HU + 1024")
      .option("scale", &Options::scale, "factor that converts the unit of the camera files to mm: 10 for cm",
              at_least(1e-6));
}
