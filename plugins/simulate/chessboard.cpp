// SPDX-License-Identifier: Apache-2.0
// Photographs of a chessboard: held before the camera in several ways, and at a known place from each stop of the arm.

#include "marrow/toolbox/calibration/chessboard.hpp"
#include "marrow/domain/random.hpp"
#include "marrow/simulate/photograph.hpp"

namespace {

using namespace marrow;

struct Options : calibration::Chessboard, calibration::ChessboardPlace, phantom::Sensor {
  int photographs = 14;
  double distance_mm = 450;
  double tilt_deg = 30;
  double shift_mm = 25;
};

struct Result {
  List<Picture> boards, placed;
};

/// Camera-from-board: the board's middle about the distance ahead, tilted to all sides in turn.
RigidTransform held(const Options& options, int i, std::uint64_t seed) {
  marrow::Random random(seed, std::uint64_t(i));
  const auto within = [&](double most) { return most * (2 * random.uniform() - 1); };
  const double towards = 2 * kPi * i / options.photographs,
               tilt = radians(options.tilt_deg) * (0.5 + 0.5 * random.uniform());
  RigidTransform pose{"camera", "board"};
  pose.rotation = (Eigen::AngleAxisd(tilt, Eigen::Vector3d(std::cos(towards), std::sin(towards), 0)) *
                   Eigen::AngleAxisd(radians(within(12)), Eigen::Vector3d::UnitZ()))
                      .toRotationMatrix();
  const double right = within(options.shift_mm), down = within(options.shift_mm), ahead = within(0.15);
  pose.translation_mm = Eigen::Vector3d(right, down, options.distance_mm * (1 + ahead)) -
                        pose.rotation * calibration::middle_of_corners_mm(options);
  return pose;
}

Result chessboard(const phantom::CameraArm& arm, const Options& options, Context& context) {
  calibration::check_chessboard(options, "simulate.chessboard");
  const auto photographed = [&](const RigidTransform& world_from_board, const Camera& camera, std::uint64_t seed) {
    return phantom::photograph(phantom::chessboard(world_from_board, options.columns, options.rows, options.square_mm),
                               camera, arm.device.distortion, {{}, 0.85, {0.13, 0.15, 0.17}}, options, seed);
  };
  const auto seed_of = [&](std::size_t i) { return marrow::Random(context.seed(), 1000 + i)(); };
  Result result;
  const Camera front = phantom::camera_at(arm, 0);
  for (int i = 0; i < options.photographs; ++i) {
    context.check_cancelled();
    result.boards.add(formatted("board{}", i + 1),
                      photographed(inverse(front.camera_from_world) * held(options, i, context.seed()), front,
                                   seed_of(std::size_t(i))));
  }
  for (std::size_t i = 0; i < arm.names.size(); ++i)
    result.placed.add(arm.names[i], photographed(calibration::world_from_board(options, options),
                                                 phantom::camera_at_stop(arm, i, context.seed()), seed_of(500 + i)));
  return result;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  auto node = plugin.node("simulate.chessboard", chessboard);
  node.summary("Photographs of a chessboard: held in several ways, and at a known place from each stop of the arm")
      .random()
      .in("arm", "the camera and where its arm stops")
      .out("boards", &Result::boards, "the board held before the camera, 8 bit colour", over("photograph"))
      .out("placed", &Result::placed, "the board at its known place, from each stop of the arm", over("view"))
      .option("columns", &Options::columns, "number of inner corners in a row", at_least(3), at_most(100))
      .option("rows", &Options::rows, "number of inner corners in a column; one even, one odd", at_least(3),
              at_most(100))
      .option("square_mm", &Options::square_mm, "side of a square", at_least(0.1))
      .option("middle_mm", &Options::middle_mm, "the known place: the middle of the inner corners in the world")
      .option("turns_deg", &Options::turns_deg,
              "the known place: turns about x, then y, then z, from a board in the plane z = 0 that is seen from below")
      .option("photographs", &Options::photographs, "number of photographs of the held board", at_least(1),
              at_most(100))
      .option("distance_mm", &Options::distance_mm, "mean distance of the held board from the camera", at_least(50))
      .option("tilt_deg", &Options::tilt_deg, "largest tilt of the held board", at_least(0), at_most(60))
      .option("shift_mm", &Options::shift_mm, "largest shift of the held board across the view", at_least(0));
  phantom::declare_sensor<Options>(node);
}
