// SPDX-License-Identifier: Apache-2.0
// A pose as a transform file of ITK and 3D Slicer (.tfm), in LPS and mm. ITK's files map points of the fixed image to
// the moving one, the way images are resampled; 3D Slicer follows this, and shows the inverse as "transform to parent".
// So with world_to_ct, the default, the file moves the model from the CT to its place in the world when it is applied
// to the model in 3D Slicer.
#include <marrow/plugin.hpp>

#include "marrow/toolbox/exchange/itk_transform.hpp"
#include "marrow/toolbox/exchange/written_files.hpp"

namespace {

using namespace marrow;
using exchange::ItkTransformFile;

struct Options {
  std::string maps = "world_to_ct";
};

ItkTransformFile tfm(const Pose& pose, const Options& options) {
  const RigidTransform& world_from_ct = pose.world_from_model;
  check_rigid(world_from_ct, "the pose cannot be written as .tfm");
  return {exchange::itk_transform(options.maps == "world_to_ct" ? inverse(world_from_ct) : world_from_ct)};
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("write.tfm", tfm)
      .summary("Gives a pose as a transform of ITK and 3D Slicer (.tfm); its deviations are left out")
      .in("pose", "the pose")
      .out("transform", "one AffineTransform in LPS, mm")
      .option("maps", &Options::maps,
              "what the numbers in the file map: world_to_ct, as ITK resamples the CT in the world and as 3D Slicer "
              "expects a transform that is applied to the model; or ct_to_world, the pose itself",
              one_of({"world_to_ct", "ct_to_world"}));
  plugin.writer<ItkTransformFile>(".tfm", exchange::write_file, "transform of ITK and 3D Slicer in LPS");
}
