// SPDX-License-Identifier: Apache-2.0
// What is said of a fracture and what is done about it: of the mirrored fracture, with the mirrored robot.

#include "marrow/toolbox/robotics/robot_state.hpp"
#include "marrow/toolbox/track/track_state.hpp"
#include "tests/properties/mirrored_values.hpp"

namespace mirrored_patient {
namespace {

using namespace marrow;
using robot::RobotReport, robot::RobotState;
using shipped::figure;

// Fractures

List<Pose> poses_of(const Phantom& phantom) {
  List<Pose> poses;
  for (const Fragment& fragment : phantom.fragments) {
    Pose pose;
    pose.world_from_model = fragment.world_from_ct;
    pose.frame = fragment.frame;
    pose.covariance = 1e-6 * Matrix6d::Identity();
    poses.add(fragment.name, pose);
  }
  return poses;
}

List<Mesh> models_of(const Phantom& phantom) {
  List<Mesh> models;
  for (const Fragment& fragment : phantom.fragments) models.add(fragment.name, fragment.outer);
  return models;
}

shipped::Outputs of_fracture(const std::string& node, const Phantom& phantom, const shipped::Options& options = {}) {
  return shipped::call(node,
                       {{"poses", shipped::list(poses_of(phantom), "fragment")},
                        {"models", shipped::list(models_of(phantom), "fragment")}},
                       options);
}

void misalignment() {
  const auto left = of_fracture("fracture.misalignment", left_fracture(), {{"side", "left"}}).at("metrics"),
             right = of_fracture("fracture.misalignment", mirrored(left_fracture()), {{"side", "right"}}).at("metrics");
  for (const Metric& metric : left.as<Metrics>().items) {
    EXPECT_GT(std::abs(metric.value), 0.1) << metric.name << " would not show a change of its sign";
    // The points by which the fracture is found are not mirrored.
    EXPECT_NEAR(figure(right, metric.name), metric.value, metric.unit == "deg" ? 1e-9 : 0.1) << metric.name;
  }
  const auto one = of_fracture("fracture.misalignment", left_fracture()).at("metrics"),
             other = of_fracture("fracture.misalignment", mirrored(left_fracture())).at("metrics");
  for (const std::string name : {"apex_left_deg", "torsion_left_deg", "left_shift_mm"})
    EXPECT_NEAR(figure(other, name), -figure(one, name), 0.1) << name;
}

void reduction() {
  const auto left = of_fracture("fracture.reduction", left_fracture()),
             right = of_fracture("fracture.reduction", mirrored(left_fracture()));
  expect_mirrored(right.at("pose").as<Pose>().world_from_model, left.at("pose").as<Pose>().world_from_model, 1e-9,
                  "the pose");
  const auto vector = [](const shipped::Outputs& outputs, const std::string& what, const std::string& unit) {
    const Value& motion = outputs.at("metrics");
    return Eigen::Vector3d(figure(motion, what + "_x_" + unit), figure(motion, what + "_y_" + unit),
                           figure(motion, what + "_z_" + unit));
  };
  EXPECT_LT((vector(right, "turn", "deg") - mirrored_turn(vector(left, "turn", "deg"))).norm(), 1e-9);
  EXPECT_LT((vector(right, "shift", "mm") - mirrored(vector(left, "shift", "mm"))).norm(), 1e-9);
}

// Plans

geometry::Implant rod() {
  geometry::Implant implant;
  implant.surface = phantom::tube({0, 0, 0}, {0, 0, 100}, 5);
  implant.surface.frame = "implant";
  implant.holes = {{"across", {0.5, 0, 50}, Eigen::Vector3d(1, 0.2, 0.1).normalized(), 5},
                   {"from the front", {0, 0.3, 20}, Eigen::Vector3d(0.1, 1, 0).normalized(), 5}};
  return implant;
}

Pose pose_of_rod() {
  Pose pose;
  pose.world_from_model = {"world", "implant", rotation_from_vector({0.05, -0.1, 0.3}), {8, -5, -40}};
  Vector6d deviations;
  deviations << 0.001, 0.002, 0.006, 0.05, 0.1, 0.2;
  pose.covariance = Matrix6d(deviations.cwiseAbs2().asDiagonal());
  return pose;
}

List<View> views() {
  const CArm arm{512, 512, Eigen::Vector2d::Constant(0.586), 1000, 600, Eigen::Vector3d::Zero()};
  List<View> views;
  for (const double beta_deg : {0.0, 90.0}) {
    View view;
    view.name = std::to_string(beta_deg);
    view.camera = carm_camera(arm, world_from_camera_rotation(0, radians(beta_deg)));
    view.image.pixels = cv::Mat(512, 512, CV_16U, cv::Scalar(1000));
    views.add(view.name, view);
  }
  return views;
}

Value plan_of(const geometry::Implant& implant, const Pose& pose, const std::string& side) {
  List<View> seen = views();
  return shipped::call("plan.locking",
                       {{"implant", shipped::item(implant)},
                        {"pose", shipped::item(pose)},
                        {"views", shipped::list(seen, "view")}},
                       {{"side", side}})
      .at("plan");
}

void locking() {
  const Value left = plan_of(rod(), pose_of_rod(), "left"),
              right = plan_of(mirrored(rod()), mirrored(pose_of_rod()), "right");
  const auto &of = left.as<geometry::LockingPlan>().drills, &found = right.as<geometry::LockingPlan>().drills;
  for (std::size_t i = 0; i < of.size(); ++i) {
    EXPECT_LT((found[i].centre_mm - mirrored(of[i].centre_mm)).norm(), 1e-9) << of[i].hole;
    EXPECT_LT((found[i].direction - mirrored(of[i].direction)).norm(), 1e-9) << of[i].hole;
    EXPECT_LT((found[i].guide_mm - mirrored(of[i].guide_mm)).norm(), 1e-9) << of[i].hole;
    EXPECT_NEAR(found[i].most_deg, of[i].most_deg, 1e-9) << of[i].hole;
    EXPECT_NEAR(found[i].most_mm, of[i].most_mm, 1e-9) << of[i].hole;
    EXPECT_NEAR(found[i].alpha_deg, of[i].alpha_deg, 1e-9) << of[i].hole;
    EXPECT_NEAR(found[i].beta_deg, -of[i].beta_deg, 1e-9) << of[i].hole;
  }
}

void bodies() {
  const auto drawn = [](const geometry::Implant& implant, const Pose& pose, const std::string& side) {
    return shipped::output_list<Mesh>("plan.bodies", "models",
                                      {{"nail", shipped::item(implant.surface)},
                                       {"pose", shipped::item(pose)},
                                       {"plan", plan_of(implant, pose, side)}});
  };
  const auto of = drawn(rod(), pose_of_rod(), "left"), found = drawn(mirrored(rod()), mirrored(pose_of_rod()), "right");
  ASSERT_EQ(found.names(), of.names());
  for (std::size_t i = 0; i < of.size(); ++i)
    EXPECT_LT((fragment_frame(found[i]).origin_mm - mirrored(fragment_frame(of[i]).origin_mm)).norm(), 1e-9)
        << of.name(i);
}

// Robots

const Eigen::Vector3d kStandTurn_deg(6, -5, 8), kStandShift_mm(20, -15, 10);

/// A robot without errors. It grips the fragment.
shipped::Outputs gripped(const Phantom& phantom, const Eigen::Vector3d& turn_deg, const Eigen::Vector3d& shift_mm) {
  return shipped::call("robot.hexapod", {{"phantom", shipped::item(phantom)}},
                       {{"stand_off_deg", list_of(turn_deg)},
                        {"stand_off_mm", list_of(shift_mm)},
                        {"leg_sd_mm", 0.0},
                        {"joint_sd_mm", 0.0}});
}

void expect_mirrored_states(const shipped::Outputs& found_by, const shipped::Outputs& of_by) {
  const RobotState &found = found_by.at("state").as<RobotState>(), &of = of_by.at("state").as<RobotState>();
  expect_mirrored(found.world_from_base, of.world_from_base, 1e-5, "the base");
  expect_mirrored(found.base_from_platform, of.base_from_platform, 1e-5, "the platform");
  expect_mirrored(found.platform_from_ct, of.platform_from_ct, 1e-5, "the grip");
  const RobotReport &one = found_by.at("report").as<RobotReport>(), &other = of_by.at("report").as<RobotReport>();
  expect_mirrored(one.done, other.done, 1e-6, "what was done");
  EXPECT_NEAR(one.load.force_n, other.load.force_n, 0.5);
  EXPECT_NEAR(one.load.torque_nm, other.load.torque_nm, 0.01);
}

std::pair<shipped::Outputs, shipped::Outputs> both_gripped() {
  return {gripped(mirrored(left_fracture()), mirrored_turn(kStandTurn_deg), mirrored(kStandShift_mm)),
          gripped(left_fracture(), kStandTurn_deg, kStandShift_mm)};
}

void hexapod() {
  const auto [found, of] = both_gripped();
  expect_mirrored_states(found, of);
  expect_mirrored(found.at("report").as<RobotReport>().robot_from_world,
                  of.at("report").as<RobotReport>().robot_from_world, 1e-6, "its place as planned");
}

shipped::Outputs moved_by_robot(const Phantom& phantom, const shipped::Outputs& before, const Pose& motion) {
  return shipped::call("robot.move", {{"phantom", shipped::item(phantom)},
                                      {"state", before.at("state")},
                                      {"motion", shipped::item(motion)},
                                      {"report", before.at("report")}});
}

std::pair<shipped::Outputs, shipped::Outputs> both_moved() {
  Pose motion;
  motion.world_from_model = {"robot", "robot", rotation_from_vector({0.02, -0.01, 0.03}), {-3, 2, -4}};
  const auto [right, left] = both_gripped();
  return {moved_by_robot(mirrored(left_fracture()), right, mirrored(motion)),
          moved_by_robot(left_fracture(), left, motion)};
}

void move() {
  const auto [found, of] = both_moved();
  expect_mirrored_states(found, of);
  // It yields to the load, which depends a little on where the bones' contact is sampled.
  expect_mirrored(found.at("state").as<RobotState>().world_from_ct, of.at("state").as<RobotState>().world_from_ct, 1e-3,
                  "the fragment");
}

void scene() {
  const auto [right, left] = both_moved();
  const auto now = [](const Phantom& phantom, const shipped::Outputs& state) {
    return shipped::output<Phantom>("robot.scene", "phantom",
                                    {{"phantom", shipped::item(phantom)}, {"state", state.at("state")}});
  };
  const Phantom found = now(mirrored(left_fracture()), right), of = now(left_fracture(), left);
  for (std::size_t i = 0; i < of.fragments.size(); ++i)
    expect_mirrored(found.fragments[i].world_from_ct, of.fragments[i].world_from_ct, 1e-3, of.fragments[i].name);
}

// Guides

/// The side of the fracture on which the fragment lies, as if it were a level plane.
SignedField field_of(const Fragment& fragment) {
  constexpr double kFracture_mm = 131;
  SignedField field;
  field.grid.size = {49, 49, 121};
  field.grid.spacing_mm = {4, 4, 4};
  field.grid.origin_mm = {-96, -96, -80};
  for (int z = 0; z < 121; ++z)
    for (int k = 0; k < 49 * 49; ++k) {
      const double above = field.grid.point_from_index(Eigen::Vector3d(0, 0, z)).z() - kFracture_mm;
      field.values_mm.push_back(float(fragment.side < 0 ? above : -above));
    }
  return field;
}

void closed_loop() {
  const auto [right, left] = both_gripped();
  const auto guided = [](const Phantom& phantom, const shipped::Outputs& robot) {
    List<SignedField> fields;
    for (const Fragment& fragment : phantom.fragments) fields.add(fragment.name, field_of(fragment));
    return shipped::call("guide.closed_loop", {{"poses", shipped::list(poses_of(phantom), "fragment")},
                                               {"state", shipped::item(robot::GuideState{})},
                                               {"report", robot.at("report")},
                                               {"fields", shipped::list(fields, "fragment")},
                                               {"models", shipped::list(models_of(phantom), "fragment")}});
  };
  const auto found = guided(mirrored(left_fracture()), right), of = guided(left_fracture(), left);
  EXPECT_EQ(found.at("stop").as<Stop>().reason, of.at("stop").as<Stop>().reason);
  expect_mirrored(found.at("motion").as<Pose>().world_from_model, of.at("motion").as<Pose>().world_from_model, 1e-4,
                  "the motion");
  EXPECT_GT(figure(of.at("metrics"), "step_mm"), 0.5) << "there is something to be mirrored";
}

void open_loop() {
  const RigidTransform base{"robot", "world", rotation_from_vector({1, -2, 0.5}), {300, 40, -200}},
      hand_from_target{"hand", "target", rotation_from_vector({0.5, 0, 1}), {10, 20, 90}};
  List<Pose> hands, targets;
  for (int i = 0; i < 5; ++i) {
    Pose hand, target;
    hand.world_from_model = {"robot", "hand", rotation_from_vector({0.2 * i, 0.1 * i * i, -0.1}), {5.0 * i, 3, 200}};
    target.world_from_model = inverse(base) * hand.world_from_model * hand_from_target;
    hands.add("station" + std::to_string(i), hand);
    targets.add("station" + std::to_string(i), target);
  }
  const auto motion = [](const Phantom& phantom, const List<Pose>& hands, const List<Pose>& targets) {
    return shipped::output<Pose>("guide.open_loop", "motion",
                                 {{"poses", shipped::list(poses_of(phantom), "fragment")},
                                  {"hands", shipped::list(hands, "station")},
                                  {"targets", shipped::list(targets, "station")}})
        .world_from_model;
  };
  expect_mirrored(motion(mirrored(left_fracture()), mirrored(hands), mirrored(targets)),
                  motion(left_fracture(), hands, targets), 1e-3, "the motion");
}

void way() {
  const auto states = [](const List<Pose>& poses) {
    return shipped::output<track::Trajectory>("guide.way", "trajectory", {{"poses", shipped::list(poses, "pass")}})
        .states;
  };
  const auto of = states(poses_of(left_fracture())), found = states(mirrored(poses_of(left_fracture())));
  for (std::size_t i = 0; i < of.size(); ++i) {
    expect_mirrored(found[i].now.world_from_model, of[i].now.world_from_model, 1e-12, "a pose");
    EXPECT_LT((found[i].fragment.axes - mirrored(of[i].fragment).axes).norm(), 1e-12);
  }
}

}  // namespace

Checks checks_of_plans_and_robots() {
  return {{"fracture.misalignment", misalignment},
          {"fracture.reduction", reduction},
          {"guide.closed_loop", closed_loop},
          {"guide.open_loop", open_loop},
          {"guide.way", way},
          {"plan.bodies", bodies},
          {"plan.locking", locking},
          {"robot.hexapod", hexapod},
          {"robot.move", move},
          {"robot.scene", scene}};
}

}  // namespace mirrored_patient
