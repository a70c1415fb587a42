// SPDX-License-Identifier: Apache-2.0
// The pose of a robot's target with beads, from one image of a calibrated C-arm.
#include <marrow/plugin.hpp>

#include "marrow/base/number_text.hpp"
#include "marrow/guide/board_pose.hpp"
#include "marrow/toolbox/calibration/correspondence.hpp"

namespace {

using namespace marrow;

struct Options {
  std::filesystem::path board;
  double max_residual_px = 1;
};

Pose target(const View& view, const Options& options, Context& context) {
  check_view(view);
  const calibration::Board board = calibration::read_board_file(options.board);
  const auto discs = calibration::find_beads(view.image, {});
  constexpr std::size_t kFewest = 6;
  if (discs.size() < kFewest)
    throw Error(
        formatted("the target is not seen in view '{}': it shows {} round dark discs, at least {} are needed; bring "
                  "the robot's hand into the beam",
                  view.name, discs.size(), kFewest));
  const calibration::ViewPoints points =
      calibration::match_board(board, discs, view.camera.width_px, view.camera.height_px, view.name);
  const calibration::BoardPose found = calibration::board_pose(points, view.camera);
  context.info(formatted("{} beads, residual {:.3f} px", points.pixels.size(), found.residual_px));
  if (found.residual_px > options.max_residual_px)
    throw Error(
        formatted("the target does not fit view '{}': its beads are {:.2f} px off where its pose shows them, at most "
                  "{:.2f} px are allowed; is it this target, and the camera of this image?",
                  view.name, found.residual_px, options.max_residual_px));
  Pose pose;
  RigidTransform camera_from_target = found.camera_from_board;
  camera_from_target.source = "target";
  pose.world_from_model = inverse(view.camera.camera_from_world) * camera_from_target;
  pose.cost = found.residual_px;
  return pose;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("guide.target", target)
      .summary("The pose of a robot's target with beads in an image (SQPnP, then least squares)")
      .in("view", "image of the target, with its camera")
      .out("pose", "pose of the target in the world; its cost is the residual in px")
      .option("board", &Options::board, "file with the positions of the target's beads (YAML, docs/case.md)",
              required())
      .option("max_residual_px", &Options::max_residual_px, "a larger residual is an error", at_least(0));
}
