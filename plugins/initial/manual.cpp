// SPDX-License-Identifier: Apache-2.0
// A start given by hand: the nominal placement, moved about and along the fragment's own axes.
#include <marrow/plugin.hpp>

namespace {

struct Options {
  std::array<double, 3> rotation_deg{0, 0, 0};
  std::array<double, 3> translation_mm{0, 0, 0};
};

marrow::Pose manual(const marrow::Mesh& model, const marrow::Pose* start, const Options& options) {
  marrow::check_mesh(model, "model");
  marrow::Pose pose;
  if (start)
    pose.world_from_model = start->world_from_model;
  else
    pose.world_from_model.source = model.frame;
  marrow::check_rigid(pose.world_from_model, "start");
  pose.frame = marrow::fragment_frame(model);
  marrow::Vector6d motion;
  for (int i = 0; i < 3; ++i) {
    motion(i) = marrow::radians(options.rotation_deg[i]);
    motion(3 + i) = options.translation_mm[i];
  }
  pose.world_from_model = marrow::moved(pose.world_from_model, pose.frame, motion);
  return pose;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("initial.manual", manual)
      .summary("The nominal placement, moved by hand about and along the fragment's axes")
      .in("model", "surface of the fragment")
      .in("start", "nominal placement; without one the CT's coordinates are the world's")
      .out("pose", "the moved placement")
      .option("rotation_deg", &Options::rotation_deg, "rotation vector about the frontal, lateral and long axis")
      .option("translation_mm", &Options::translation_mm, "shift along the frontal, lateral and long axis");
}
