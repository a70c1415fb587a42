// SPDX-License-Identifier: Apache-2.0
// The pose of a robot's target with beads, from one image of a calibrated C-arm.
#include <marrow/plugin.hpp>
#include <opencv2/calib3d.hpp>

#include "marrow/toolbox/calibration/board.hpp"

namespace {

using namespace marrow;

struct Options {
  std::filesystem::path board;
  double max_residual_px = 1;
};

struct BoardPose {
  RigidTransform camera_from_target{"camera", "target"};
  double residual_px = 0;  ///< root mean square of the distances in the image
};

/// The pose with the least sum of squared distances in the image. OpenCV's SQPnP (Terzakis and Lourakis, ECCV 2020)
/// gives the start; Levenberg-Marquardt steps refine it.
BoardPose board_pose(const calibration::ViewPoints& points, const Camera& camera) {
  constexpr std::size_t kFewest = 6;
  if (points.pixels.size() < kFewest)
    throw Error(formatted("view '{}' shows {} beads of the target; its pose needs {} or more", points.name,
                          points.pixels.size(), kFewest));
  std::vector<cv::Point3d> board;
  std::vector<cv::Point2d> pixels;
  for (std::size_t i = 0; i < points.pixels.size(); ++i) {
    board.emplace_back(points.board_mm[i].x(), points.board_mm[i].y(), points.board_mm[i].z());
    pixels.emplace_back(points.pixels[i].x(), points.pixels[i].y());
  }
  cv::Matx33d intrinsics;
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 3; ++column) intrinsics(row, column) = camera.intrinsics(row, column);
  cv::Vec3d turn, shift;
  if (!cv::solvePnP(board, pixels, intrinsics, cv::noArray(), turn, shift, false, cv::SOLVEPNP_SQPNP))
    throw Error("view '" + points.name +
                "': no pose of the target explains its beads; is it the camera of this image?");
  cv::solvePnPRefineLM(board, pixels, intrinsics, cv::noArray(), turn, shift);
  BoardPose pose;
  pose.camera_from_target.rotation = rotation_from_vector({turn[0], turn[1], turn[2]});
  pose.camera_from_target.translation_mm = {shift[0], shift[1], shift[2]};
  std::vector<cv::Point2d> back;
  cv::projectPoints(board, turn, shift, intrinsics, cv::noArray(), back);
  double squares = 0;
  for (std::size_t i = 0; i < back.size(); ++i) squares += (back[i] - pixels[i]).dot(back[i] - pixels[i]);
  pose.residual_px = std::sqrt(squares / double(back.size()));
  return pose;
}

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
  const BoardPose found = board_pose(points, view.camera);
  context.info(formatted("{} beads, residual {:.3f} px", points.pixels.size(), found.residual_px));
  if (found.residual_px > options.max_residual_px)
    throw Error(
        formatted("the target does not fit view '{}': its beads are {:.2f} px off where its pose shows them, at most "
                  "{:.2f} px are allowed; is it this target, and the camera of this image?",
                  view.name, found.residual_px, options.max_residual_px));
  Pose pose;
  pose.world_from_model = inverse(view.camera.camera_from_world) * found.camera_from_target;
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
