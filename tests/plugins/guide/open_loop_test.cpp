// SPDX-License-Identifier: Apache-2.0
// The target on a robot's hand, and the one move that follows from it.
#include "marrow/domain/random.hpp"
#include "marrow/toolbox/phantom/board_views.hpp"
#include "tests/harness/node_test.hpp"

namespace marrow::test::open_loop_test {

const std::string kBoard = std::string(MARROW_SOURCE_DIR) + "/pipelines/calibration/board.yaml";

Calibration device() {
  phantom::DeviceOptions options;
  options.pincushion_percent = 0;
  options.pixel_mm = 0.35;
  return phantom::make_device(options);
}

View view_of(const RigidTransform& camera_from_target) {
  View view;
  view.name = "frontal";
  view.camera = {device().width_px, device().height_px, device().intrinsics, {"camera", "world"}};
  view.camera.camera_from_world.translation_mm = {0, 0, 600};
  view.image = phantom::expose_board(calibration::read_board_file(kBoard), device(), camera_from_target, {}, 3);
  return view;
}

TEST(GuideTarget, IsFoundToAHundredthOfADegree) {
  const RigidTransform exact{"camera", "world", rotation_from_vector({0.1, -0.05, 0.4}), {5, -4, 560}};
  const View view = view_of(exact);
  const Pose found = output<Pose>("guide.target", "pose", {{"view", item(view)}}, {{"board", kBoard}});
  const RigidTransform camera_from_target = view.camera.camera_from_world * found.world_from_model;
  EXPECT_LT(turn_between_deg(camera_from_target, exact), 0.02);
  EXPECT_LT(shift_between_mm(camera_from_target, exact), 0.2);
  EXPECT_EQ(found.world_from_model.source, "target");
  EXPECT_LT(found.cost, 0.1);
}

TEST(GuideTarget, SaysThatItIsNotSeen) {
  View view = view_of({"camera", "world", Matrix3d::Identity(), {2000, 0, 600}});
  const std::string text = refusal("guide.target", {{"view", item(view)}}, {{"board", kBoard}});
  EXPECT_FRAME(text, "the target is not seen in view 'frontal': it shows ",
               " round dark discs, at least 6 are needed; bring the robot's hand into the beam");
}

TEST(GuideTarget, SaysThatTheCameraIsAnotherOne) {
  View view = view_of({"camera", "world", rotation_from_vector({0.1, -0.05, 0.4}), {5, -4, 560}});
  view.camera.intrinsics(0, 0) *= 1.3;
  const std::string text = refusal("guide.target", {{"view", item(view)}}, {{"board", kBoard}});
  EXPECT_FRAME(text, "the target does not fit view 'frontal': its beads are ",
               "at most 1.00 px are allowed; is it this target, and the camera of this image?");
}

struct Scene {
  List<Pose> poses, hands, targets;
};

const RigidTransform kBase{"robot", "world", rotation_from_vector({1, -2, 0.5}), {300, 40, -200}};

Scene scene() {
  Scene scene;
  Pose proximal, distal;
  proximal.world_from_model = {"world", "ct", rotation_from_vector({0.1, 0.2, 0.3}), {1, 2, 3}};
  distal.world_from_model = {"world", "ct", rotation_from_vector({0.2, 0.1, 0.4}), {9, -2, -3}};
  proximal.frame.is_anatomical = distal.frame.is_anatomical = true;
  scene.poses = named("proximal", proximal, "distal", distal);
  const RigidTransform hand_from_target{"hand", "target", rotation_from_vector({0.5, 0, 1}), {10, 20, 90}};
  for (int i = 0; i < 4; ++i) {
    Pose hand, target;
    hand.world_from_model = {"robot", "hand", rotation_from_vector({0.2 * i, 0.1 * i * i, -0.1}), {5.0 * i, 3, 200}};
    target.world_from_model = inverse(kBase) * hand.world_from_model * hand_from_target;
    const std::string name = "station" + std::to_string(i + 1);
    scene.hands.add(name, hand);
    scene.targets.add(name, target);
  }
  return scene;
}

Inputs inputs(const Scene& scene) {
  return {{"poses", shipped::list(scene.poses, "fragment")},
          {"hands", shipped::list(scene.hands, "station")},
          {"targets", shipped::list(scene.targets, "station")}};
}

TEST(OpenLoop, OneMoveBringsTheFragmentToItsPlace) {
  for (const std::string method : {"ax_zb", "ax_xb"}) {
    const Scene made = scene();
    const Pose motion = output<Pose>("guide.open_loop", "motion", inputs(made), {{"method", method}});
    const RigidTransform after =
        inverse(kBase) * motion.world_from_model * kBase * made.poses.find("distal")->world_from_model;
    const RigidTransform& place = made.poses.find("proximal")->world_from_model;
    EXPECT_LT(turn_between_deg(after, place), 1e-4) << method;
    EXPECT_LT(shift_between_mm(after, place), 1e-3) << method;
  }
}

/// The target is seen with an error in each station.
Scene with_noise(Scene scene, double noise_deg, double noise_mm) {
  Random random(4);
  const auto drawn = [&](double deviation) {
    const double x = random.normal(), y = random.normal(), z = random.normal();
    return Vector3d(deviation * Vector3d(x, y, z));
  };
  scene.targets = scene.targets.changed([&](Pose& target, std::size_t) {
    target.world_from_model.rotation =
        rotation_from_vector(drawn(radians(noise_deg))) * target.world_from_model.rotation;
    target.world_from_model.translation_mm += drawn(noise_mm);
  });
  return scene;
}

TEST(OpenLoop, SaysHowFarFromItsPlaceTheMoveLeavesTheFragment) {
  for (const std::string method : {"ax_zb", "ax_xb"}) {
    const Scene made = with_noise(scene(), 0.02, 0.05);
    const auto outputs = call("guide.open_loop", inputs(made), {{"method", method}});
    const RigidTransform after = inverse(kBase) * outputs.at("motion").as<Pose>().world_from_model * kBase *
                                 made.poses.find("distal")->world_from_model;
    const RigidTransform& place = made.poses.find("proximal")->world_from_model;
    const double left_deg = figure(outputs.at("metrics"), "left_deg"),
                 left_mm = figure(outputs.at("metrics"), "left_mm");
    EXPECT_LT(turn_between_deg(after, place), 4 * left_deg) << method;
    EXPECT_LT(shift_between_mm(after, place), 4 * left_mm) << method;
    EXPECT_LT(left_mm, 0.5) << method;
  }
}

TEST(OpenLoop, AMoveByARobotWhosePlaceIsHardlyKnownIsRefused) {
  for (const std::string method : {"ax_zb", "ax_xb"}) {
    const Scene made = with_noise(scene(), 0.5, 1);
    const std::string text = refusal("guide.open_loop", inputs(made), {{"method", method}});
    EXPECT_FRAME(text, "the stations do not tell well enough where the robot is: this move would leave the fragment ",
                 " mm from its place (one standard deviation), at most 2 degrees and 2 mm are allowed; turn the "
                 "robot further between stations, about axes that are at least 30 degrees apart, or raise "
                 "max_deviation_deg and max_deviation_mm")
        << method;
    EXPECT_EQ(refusal("guide.open_loop", inputs(made),
                      {{"method", method}, {"max_deviation_deg", 90.0}, {"max_deviation_mm", 1000.0}}),
              "")
        << method;
  }
}

TEST(OpenLoop, SaysThatThePosesDoNotShowTheFragmentsMiddle) {
  Scene made = scene();
  made.poses = made.poses.changed([](Pose& pose, std::size_t) { pose.frame.is_anatomical = false; });
  EXPECT_EQ(
      refusal("guide.open_loop", inputs(made)),
      "the pose of 'distal' does not say where the fragment's middle is and how its long axis runs, as a matrix alone "
      "does not; wire the surfaces of both fragments to 'models', or give the node that reads the pose its model");
}

TEST(OpenLoop, NeedsHandAndTargetOfTheSameStations) {
  Scene made = scene();
  made.targets = named("station1", made.targets[0]);
  EXPECT_EQ(refusal("guide.open_loop", inputs(made)),
            "poses of the hand and of the target are not of the same stations: there are 4 and 1");
}

}  // namespace marrow::test::open_loop_test
