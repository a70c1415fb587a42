// SPDX-License-Identifier: Apache-2.0
// Before it grips the fragment, a robot shows a target with beads on its hand to the C-arm, in several poses.

#include "marrow/domain/random.hpp"
#include "marrow/toolbox/phantom/board_views.hpp"
#include "marrow/toolbox/robotics/robot_state.hpp"

namespace {

using namespace marrow;
using robot::RobotState;

struct Options : phantom::Exposure {
  std::filesystem::path board;
  int stations = 8;
  double tilt_deg = 12;
  double shift_mm = 10;
  int station_seed = 1;
};

struct Result {
  List<View> views;
  List<Pose> hands;
};

Eigen::Vector3d middle_of(const calibration::Board& board) {
  Eigen::Vector3d low = board.beads[0].centre_mm, high = low;
  for (const auto& bead : board.beads) low = low.cwiseMin(bead.centre_mm), high = high.cwiseMax(bead.centre_mm);
  return 0.5 * (low + high);
}

/// At home, the target's middle lies in the origin of the world, and its plane across the beam, tilted a little.
RigidTransform world_from_target(const calibration::Board& board, const Camera& camera) {
  RigidTransform camera_from_target{"camera", "target", rotation_from_vector({0.1, -0.08, 0.2}),
                                    Eigen::Vector3d::Zero()};
  camera_from_target.translation_mm =
      camera.camera_from_world * Eigen::Vector3d(0, 0, 0) - camera_from_target.rotation * middle_of(board);
  return inverse(camera.camera_from_world) * camera_from_target;
}

/// A motion of the hand about a point in the axes of the base, drawn for a station.
RigidTransform drawn(marrow::Random& random, const Options& options, const Eigen::Vector3d& about_mm) {
  const auto vector = [&](double most) {
    const double x = random.uniform(), y = random.uniform(), z = random.uniform();
    return Eigen::Vector3d(most * (2 * Eigen::Vector3d(x, y, z) - Eigen::Vector3d::Ones()) / std::sqrt(3.0));
  };
  RigidTransform motion{"base", "base", rotation_from_vector(vector(radians(options.tilt_deg))), {}};
  motion.translation_mm = about_mm - motion.rotation * about_mm + vector(options.shift_mm);
  return motion;
}

Result stations(const RobotState& state, const Camera& camera, const View* stated, const Options& options,
                Context& context) {
  check_camera(camera, "the camera");
  const calibration::Board board = calibration::read_board_file(options.board);
  const robot::Hexapod nominal = robot::make_hexapod(state.shape),
                       built = robot::as_built(nominal, state.errors.joint_sd_mm, state.errors.robot_seed);
  const RigidTransform home =
      robot::pose_of_legs(built, robot::leg_lengths_mm(nominal, nominal.base_from_home), nominal.base_from_home)
          .base_from_platform;
  const RigidTransform target = world_from_target(board, camera);
  const RigidTransform platform_from_target = inverse(state.world_from_base * home) * target;
  const Eigen::Vector3d about_mm = inverse(state.world_from_base) * (target * middle_of(board));
  Calibration device;
  device.width_px = camera.width_px, device.height_px = camera.height_px, device.intrinsics = camera.intrinsics;
  Result result;
  double worst = robot::condition(nominal, nominal.base_from_home);
  for (int i = 0; i < options.stations; ++i) {
    context.check_cancelled();
    const std::string name = formatted("station{}", i + 1);
    marrow::Random random(std::uint64_t(options.station_seed), std::uint64_t(i));
    const RigidTransform told = drawn(random, options, about_mm) * nominal.base_from_home;
    robot::check_workspace(nominal, state.limits, told, "robot.stations: " + name);
    worst = std::max(worst, robot::condition(nominal, told));
    Vector6d lengths = robot::leg_lengths_mm(nominal, told);
    for (int k = 0; k < 6; ++k) lengths[k] += state.errors.leg_sd_mm * random.normal();
    RigidTransform camera_from_board = camera.camera_from_world * state.world_from_base *
                                       robot::pose_of_legs(built, lengths, told).base_from_platform *
                                       platform_from_target;
    View view;
    view.name = name;
    view.camera = camera;
    if (stated) view.camera.camera_from_world = stated->camera.camera_from_world;
    view.image = phantom::expose_board(board, device, camera_from_board, options, random());
    result.views.add(name, view);
    Pose hand;
    hand.world_from_model = {"robot", "hand", told.rotation, told.translation_mm};
    result.hands.add(name, hand);
  }
  if (const std::string text = robot::doubtful_condition(worst, "a station"); !text.empty()) context.warn(text);
  return result;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("robot.stations", stations)
      .summary("A robot shows the target on its hand to the C-arm, in several poses")
      .in("state", "the robot; the target is on its hand instead of the fragment")
      .in("camera", "the exact camera; with the robot at home, it sees the target in the middle")
      .in("stated", "a view with the camera as the calibration states it, for the images; none: the exact one")
      .out("views", &Result::views, "image of the target at each station", over("station"))
      .out("hands", &Result::hands, "pose of the hand in the robot's base by its encoders", over("station"))
      .option("board", &Options::board, "file with the positions of the target's beads (YAML, docs/case.md)",
              required())
      .option("stations", &Options::stations, "number of poses", at_least(1), at_most(100))
      .option("tilt_deg", &Options::tilt_deg, "largest rotation from home", at_least(0), at_most(60))
      .option("shift_mm", &Options::shift_mm, "largest shift from home", at_least(0))
      .option("station_seed", &Options::station_seed, "seed of the poses and of the images' noise", at_least(0))
      .option("attenuation_per_mm", &Options::attenuation_per_mm,
              "attenuation coefficient of the beads (steel at 60 keV: 0.9)", at_least(0), unit("1/mm"))
      .option("photons", &Options::photons, "photons per pixel beside the beads; 0: no noise", at_least(0),
              unit("1/px"))
      .option("blur_px", &Options::blur_px, "standard deviation of the detector's blur", at_least(0), at_most(10));
}
