// SPDX-License-Identifier: Apache-2.0
// The guide with poses that are made up, without images: a robot that does what it is told, somewhere.
#include "marrow/domain/random.hpp"
#include "marrow/guide/servo.hpp"
#include "marrow/toolbox/robotics/robot_state.hpp"
#include "tests/harness/node_test.hpp"

namespace marrow::test::closed_loop_test {

using robot::GuideState, robot::RobotReport;

/// Two blocks, one above the other, 2 mm apart at z = 0. The distal one lies below.
constexpr double kHalf_mm = 12, kLong_mm = 60, kGap_mm = 2;

Mesh block(double from_z, double to_z) {
  Mesh mesh;
  mesh.frame = "ct";
  for (int i = 0; i < 8; ++i)
    mesh.vertices_mm.emplace_back(i & 1 ? kHalf_mm : -kHalf_mm, i & 2 ? kHalf_mm : -kHalf_mm, i & 4 ? to_z : from_z);
  mesh.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                    {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  return mesh;
}

SignedField field(double from_z, double to_z) {
  return field_by(grid_at({33, 33, 81}, {-32, -32, -80}, {2, 2, 2}), [&](const Vector3d& at) {
    return std::max({std::abs(at.x()) - kHalf_mm, std::abs(at.y()) - kHalf_mm, from_z - at.z(), at.z() - to_z});
  });
}

List<Mesh> models() { return named("proximal", block(0, kLong_mm), "distal", block(-kGap_mm - kLong_mm, -kGap_mm)); }

List<SignedField> fields() {
  return named("proximal", field(0, kLong_mm), "distal", field(-kGap_mm - kLong_mm, -kGap_mm));
}

const RigidTransform kProximal{"world", "ct", rotation_from_vector({0.2, 0.1, -0.3}), {5, 6, 7}};

/// Both poses; `place`: of the distal fragment beside the proximal one.
List<Pose> poses(const RigidTransform& place, double deviation_deg = 0.1, double deviation_mm = 0.06) {
  List<Pose> all;
  for (const std::string name : {"proximal", "distal"}) {
    Pose pose;
    pose.frame = fragment_frame(*models().find(name));
    pose.world_from_model = name == "distal" ? kProximal * place : kProximal;
    Vector6d deviation;
    deviation << Vector3d::Constant(radians(deviation_deg)), Vector3d::Constant(deviation_mm);
    pose.covariance = deviation.cwiseAbs2().asDiagonal();
    all.add(name, pose);
  }
  return all;
}

RigidTransform displaced(Vector3d turn_deg, Vector3d shift_mm) {
  FragmentFrame frame = fragment_frame(*models().find("distal"));
  Vector6d motion;
  motion << turn_deg * radians(1), shift_mm;
  return moved({"ct", "ct"}, frame, motion);
}

Inputs inputs(const List<Pose>& poses, const GuideState& state = {}, const RobotReport& report = {}) {
  return {{"poses", shipped::list(poses, "fragment")},
          {"state", item(state)},
          {"report", item(report)},
          {"fields", shipped::list(fields(), "fragment")},
          {"models", shipped::list(models(), "fragment")}};
}

Outputs closed_loop(const List<Pose>& poses, const Options& options = {}) {
  return call("guide.closed_loop", inputs(poses), options);
}

/// The robot pressed the bones together, and stopped.
RobotReport pressed() {
  RobotReport report;
  report.stopped = "the force would pass 400 N";
  report.is_pressed = true;
  return report;
}

Stop stop_of(const Outputs& outputs) { return outputs.at("stop").as<Stop>(); }

/// The loop, closed by a robot that stands anywhere. Each pair's outputs.
std::vector<Outputs> loop(const std::string& hand_eye, const Vector3d& stand_deg) {
  RigidTransform robot_from_world{"robot", "world", rotation_from_vector(stand_deg * radians(1)), {20, -30, 25}};
  RobotReport report;
  RigidTransform place = displaced({6, -5, 9}, {8, -6, -10});
  GuideState state;
  Random random(5);
  std::vector<Outputs> pairs;
  for (int pair = 0; pair < 8; ++pair) {
    Vector6d noise;
    for (int k = 0; k < 6; ++k) noise[k] = random.normal() * (k < 3 ? radians(0.1) : 0.06);
    const RigidTransform seen = moved(place, fragment_frame(*models().find("distal")), noise);
    pairs.push_back(call("guide.closed_loop", inputs(poses(seen), state, report), {{"hand_eye", hand_eye}}));
    if (stop_of(pairs.back()).stops) break;
    state = pairs.back().at("state").as<GuideState>();
    report.done = pairs.back().at("motion").as<Pose>().world_from_model;
    RigidTransform world_motion = inverse(robot_from_world) * report.done * robot_from_world;
    RigidTransform in_ct = inverse(kProximal) * world_motion * kProximal;
    place = in_ct * place;
  }
  return pairs;
}

TEST(ClosedLoop, PosesWithoutAxesOfTheirOwnAreTakenAboutTheirSurfaces) {
  // A covariance about the CT's origin, as a file gives it, is the same one about the fragment's middle.
  const List<Pose> own = poses(displaced({6, -5, 9}, {8, -6, -10}));
  const List<Pose> from_files = own.changed([](Pose& pose, std::size_t) { pose = in_frame(pose, FragmentFrame()); });
  const auto expected = closed_loop(own), found = closed_loop(from_files);
  const RigidTransform &one = expected.at("motion").as<Pose>().world_from_model,
                       &other = found.at("motion").as<Pose>().world_from_model;
  EXPECT_LT((one.rotation - other.rotation).norm(), 1e-9);
  EXPECT_LT(shift_between_mm(one, other), 1e-6);
  EXPECT_NEAR(figure(expected.at("metrics"), "shift_mm"), figure(found.at("metrics"), "shift_mm"), 1e-9);
  const auto poses_one = expected.at("predicted").as_list<Pose>(), poses_other = found.at("predicted").as_list<Pose>();
  for (std::size_t i = 0; i < poses_one.size(); ++i)
    EXPECT_EQ(poses_one[i].frame.origin_mm, poses_other[i].frame.origin_mm) << poses_one.name(i);
}

TEST(ClosedLoop, ReducesTheFractureWhereverTheRobotStands) {
  for (const Vector3d& stand : {Vector3d(0, 5, 0), Vector3d(60, -50, 40), Vector3d(-100, 90, 60)}) {
    const auto pairs = loop("estimated", stand);
    EXPECT_BEGINS(stop_of(pairs.back()).reason, "the fracture is reduced: ");
    EXPECT_LE(pairs.size(), 7u);
    EXPECT_LT(figure(pairs.back().at("metrics"), "rotation_deg"), 0.5);
    EXPECT_LT(figure(pairs.back().at("metrics"), "shift_mm"), 0.5);
    EXPECT_EQ(figure(pairs.back().at("metrics"), "images"), 2 * double(pairs.size()));
    EXPECT_EQ(figure(pairs.back().at("metrics"), "reduced"), 1);
    const RigidTransform none = pairs.back().at("motion").as<Pose>().world_from_model;
    EXPECT_TRUE(none.rotation.isIdentity() && none.translation_mm.isZero());
  }
}

TEST(ClosedLoop, AFixedPlaceThatIsWrongEndsWithAReason) {
  const auto pairs = loop("fixed", {-100, 90, 60});
  EXPECT_TRUE(stop_of(pairs.back()).reason.starts_with("the way has not become shorter in two pairs of images: ") ||
              stop_of(pairs.back()).reason.starts_with("8 pairs of images are taken, no more are allowed: "))
      << stop_of(pairs.back()).reason;
}

TEST(ClosedLoop, NoStepIsLargerThanItsLimits) {
  for (const std::string hand_eye : {"estimated", "broyden", "fixed"})
    for (const auto& pair : loop(hand_eye, {60, -50, 40})) {
      EXPECT_LE(figure(pair.at("metrics"), "step_deg"), 15 + 1e-9);
      EXPECT_LE(figure(pair.at("metrics"), "step_mm"), 25 + 1e-9);
    }
}

/// How far a step leads the fracture astray at most, if nothing is known of the robot's place. Then its direction
/// counts as known to 1.5 rad and its place to 60 mm; the fracture lies 150 mm from the fragment's middle.
double astray_mm(const Value& figures) {
  const double turn = radians(figure(figures, "step_deg"));
  return 1.5 * (figure(figures, "step_mm") + 150 * turn) + 60 * turn;
}

TEST(ClosedLoop, TheFirstStepIsShortIfTheRobotMayStandAnywhere) {
  const auto first = [](double limit_mm, const std::string& hand_eye) {
    return closed_loop(poses(displaced({6, -5, 9}, {8, -6, -10})), {{"hand_eye", hand_eye}, {"astray_mm", limit_mm}})
        .at("metrics");
  };
  EXPECT_NEAR(astray_mm(first(12, "estimated")), 12, 1e-6);
  EXPECT_NEAR(astray_mm(first(20, "estimated")), 20, 1e-6);
  EXPECT_GT(astray_mm(first(12, "fixed")), 20);
  // As far as the bones are apart, it may go astray in any case. The gap is 2 mm in the CT, and 10 mm more.
  const Value apart = closed_loop(poses(displaced({0, 0, 5}, {0, 0, -10})), {{"astray_mm", 1.0}}).at("metrics");
  EXPECT_NEAR(figure(apart, "distance_mm"), 12, 1e-3);
  EXPECT_NEAR(astray_mm(apart), 12, 0.01);
}

TEST(ClosedLoop, AfterBonesHavePressedItGoesBack) {
  GuideState state;
  state.told.rotation = rotation_from_vector({0.01, 0.02, 0});
  state.told.translation_mm = {1, 2, 3};
  const auto poses_now = poses(displaced({6, -5, 9}, {8, -6, -10}));
  const auto told = [&](const RobotReport& report) {
    return output<Pose>("guide.closed_loop", "motion", inputs(poses_now, state, report)).world_from_model;
  };
  const RigidTransform none = told(pressed()) * state.told;
  EXPECT_TRUE(none.rotation.isIdentity(1e-9) && none.translation_mm.isZero(1e-9));
  // It does not, because the robot cannot reach farther.
  RobotReport beyond;
  beyond.stopped = "a leg is too long";
  EXPECT_FALSE((told(beyond) * state.told).translation_mm.isZero(0.1));
}

TEST(ClosedLoop, AfterBonesHavePressedItPullsThemApartIfItKnowsHow) {
  const auto pairs = loop("estimated", {60, -50, 40});
  GuideState state = pairs[3].at("state").as<GuideState>();
  const auto pair = call("guide.closed_loop", inputs(poses(displaced({6, -5, 9}, {8, -6, -10})), state, pressed()));
  EXPECT_BEGINS(stop_of(pair).reason, "distract: ");
  EXPECT_NEAR(figure(pair.at("metrics"), "step_mm"), 4, 1e-6);
  EXPECT_EQ(figure(pair.at("metrics"), "step_deg"), 0);
}

TEST(ClosedLoop, FragmentsThatOverlapAreMovedApart) {
  const auto pair = closed_loop(poses(displaced({0, 0, 0}, {9, 0, 10})));
  EXPECT_LT(figure(pair.at("metrics"), "distance_mm"), 0);
  // Away from the proximal fragment, which lies at larger z of its own frame.
  const RigidTransform told = pair.at("motion").as<Pose>().world_from_model;
  EXPECT_LT((kProximal.rotation.transpose() * told.translation_mm).z(), -1);
}

TEST(ClosedLoop, EndsWhereTheImagesShowNoMore) {
  const auto reason = [](double turn_deg, double shift_mm) {
    return stop_of(closed_loop(poses(displaced({0, 0, turn_deg}, {shift_mm, 0, 0}), 0.3, 0.2))).reason;
  };
  EXPECT_BEGINS(reason(0.4, 0.2),
                "the fragment is in its place as far as the images show: 0.40 degrees and 0.20 mm "
                "remain, known to 0.42 degrees and 0.43 mm");
  EXPECT_BEGINS(reason(0.5, 0.2), "release: ");
  EXPECT_BEGINS(reason(0.4, 0.5), "release: ");
}

TEST(ClosedLoop, StopsForAReason) {
  GuideState state;
  RobotReport report;
  state.stops = 3;
  report.stopped = "the force would pass 400 N";
  EXPECT_BEGINS(
      stop_of(call("guide.closed_loop", inputs(poses(displaced({5, 0, 0}, {5, 0, -5})), state, report))).reason,
      "the robot stopped 4 times in a row: the force would pass 400 N; ");
  EXPECT_BEGINS(stop_of(closed_loop(poses(displaced({5, 0, 0}, {5, 0, -5}), 3, 0.1))).reason,
                "the poses are not trusted: they are known to 4.24 degrees and ");
  const List<Pose> unknown = poses(displaced({5, 0, 0}, {5, 0, -5}));
  Pose without = *unknown.find("distal");
  without.covariance.reset();
  EXPECT_EQ(stop_of(closed_loop(named("proximal", *unknown.find("proximal"), "distal", without))).reason,
            "the pose of 'distal' is not trusted: the images do not determine it");
  Verdict verdict;
  verdict.judgement = Judgement::wrong;
  verdict.reasons = {"it lies on no edge"};
  EXPECT_EQ(
      stop_of(call("guide.closed_loop", with(inputs(unknown), {{"verdicts", per_fragment("distal", verdict)}}))).reason,
      "the pose of 'distal' is not trusted: it lies on no edge");
}

TEST(ClosedLoop, SaysWhatIsMissing) {
  Inputs lacking = inputs(poses(displaced({1, 0, 0}, {0, 0, -5})));
  const List<Mesh> one = named("proximal", block(0, kLong_mm));
  lacking["models"] = shipped::list(one, "fragment");
  EXPECT_EQ(
      refusal("guide.closed_loop", lacking),
      "there is no surface of a fragment 'distal', only of proximal; name both fragments with moved and reference");
  List<Mesh> apart = one;
  apart.add("distal", block(-80, -40));
  lacking["models"] = shipped::list(apart, "fragment");
  const List<SignedField> fields = named("proximal", field(0, kLong_mm), "distal", field(-80, -40));
  lacking["fields"] = shipped::list(fields, "fragment");
  EXPECT_EQ(refusal("guide.closed_loop", lacking),
            "the two fragments are nowhere within 3 mm of each other in the CT; are they sides of one fracture?");
}

TEST(GuideWay, HasAPoseForEachPair) {
  List<Pose> pairs;
  for (int i = 0; i < 3; ++i) pairs.add(std::to_string(i + 1), poses(displaced({double(i), 0, 0}, {0, 0, 0}))[1]);
  const Value way = call("guide.way", {{"poses", shipped::list(pairs, "pass")}}).at("trajectory");
  EXPECT_FALSE(way.is_absent());
}

}  // namespace marrow::test::closed_loop_test
