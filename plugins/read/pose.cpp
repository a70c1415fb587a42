// SPDX-License-Identifier: Apache-2.0
// A pose maps the CT to the world. ITK's transform files map points of the fixed image (here the world) to the moving
// one (the CT). 3D Slicer saves transforms in the same way: for a model that was moved by hand to its place in the
// world, the file holds the inverse of this motion.
#include <marrow/plugin.hpp>

#include "marrow/toolbox/exchange/itk_transform.hpp"
#include "marrow/toolbox/files/yaml_values.hpp"
#include "marrow/toolbox/geometry/targets.hpp"

namespace {

struct Options {
  std::filesystem::path path;
  std::string maps = "world_to_ct";
};

/// `frame`: the model's frame, which a transform file does not name.
marrow::Pose pose_in(const Options& options, const std::string& frame) {
  if (!marrow::exchange::is_itk_transform_file(options.path)) {
    if (options.maps != "world_to_ct")
      throw marrow::Error(
          options.path.string() +
          ": says itself what it maps; maps is only for transforms of ITK (.tfm or .txt), so leave it out");
    return marrow::files::read_pose_file(options.path);
  }
  marrow::Pose pose;
  pose.world_from_model = options.maps == "ct_to_world"
                              ? marrow::exchange::read_itk_transform(options.path, "world", frame)
                              : inverse(marrow::exchange::read_itk_transform(options.path, frame, "world"));
  return pose;
}

marrow::Pose pose(const marrow::Mesh* model, const Options& options) {
  const marrow::Pose read = pose_in(options, model ? model->frame : "ct");
  if (!model) return read;
  marrow::geometry::check_model(read.world_from_model, *model);
  return in_frame(read, fragment_frame(*model));
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("read.pose", pose)
      .summary(
          "Reads a pose from marrow's YAML or from a transform of ITK and 3D Slicer, for example a start that was "
          "found by hand, or the result of another run")
      .in("model", "surface of the fragment: it gives the pose its axes, which a transform file does not have")
      .out("pose", "pose of the model in the world")
      .option("path", &Options::path,
              "pose file; .tfm or .txt: a transform of ITK and 3D Slicer, any other: marrow's YAML", marrow::required())
      .option("maps", &Options::maps,
              "what the numbers in a transform file map: world_to_ct, as ITK resamples the CT in the world and as 3D "
              "Slicer saves a transform that is applied to the model; or ct_to_world, the pose itself",
              marrow::one_of({"world_to_ct", "ct_to_world"}));
}
