// SPDX-License-Identifier: Apache-2.0
#include "sequences.hpp"

namespace marrow::test::joint_test {

using track::TrackState;

RigidTransform turned(const Vector3d& rotation_deg, const Vector3d& shift_mm = {0, 0, 0}) {
  RigidTransform pose{"world", "ct"};
  pose.rotation = rotation_from_vector(rotation_deg * radians(1));
  pose.translation_mm = shift_mm;
  return pose;
}

List<TrackState> states(const std::vector<RigidTransform>& poses) {
  List<TrackState> list;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    TrackState state;
    state.now.world_from_model = poses[i];
    list.add(std::to_string(i + 1), state);
  }
  return list;
}

std::vector<Value> motion(const std::vector<RigidTransform>& proximal, const std::vector<RigidTransform>& distal,
                          const Options& options = {}) {
  return call("track.joint",
              {{"proximal", shipped::list(states(proximal), "frame")},
               {"distal", shipped::list(states(distal), "frame")}},
              options)
      .at("metrics")
      .items;
}

// In the CT, +x is the patient's left, +y the back, +z up.
TEST(Joint, AFlexedKneeBringsTheFootBack) {
  // About the left: the lower leg, which hangs down, moves to the back.
  const auto found = motion({turned({0, 0, 0})}, {turned({30, 0, 0})});
  EXPECT_NEAR(figure(found[0], "flexion_deg"), 30, 1e-9);
  EXPECT_NEAR(figure(found[0], "adduction_deg"), 0, 1e-9);
  EXPECT_NEAR(figure(found[0], "internal_rotation_deg"), 0, 1e-9);
}

TEST(Joint, EachAngleByItself) {
  // A right shin turns its front to the left: inward, about the upward axis.
  EXPECT_NEAR(figure(motion({turned({0, 0, 0})}, {turned({0, 0, 12})})[0], "internal_rotation_deg"), 12, 1e-9);
  // The lower end of a right shin moves to the left, toward the other leg: its upper end points to the right.
  EXPECT_NEAR(figure(motion({turned({0, 0, 0})}, {turned({0, -7, 0})})[0], "adduction_deg"), 7, 1e-9);
}

TEST(Joint, OnlyTheMotionBetweenTheBonesCounts) {
  const RigidTransform both{"world", "world", rotation_from_vector({0.4, -0.9, 0.2}), {30, -10, 5}};
  const auto alone = motion({turned({0, 0, 0})}, {turned({20, 5, -8}, {1, 2, 3})});
  const auto moved = motion({both * turned({0, 0, 0})}, {both * turned({20, 5, -8}, {1, 2, 3})});
  for (const Metric& metric : alone[0].as<Metrics>().items)
    EXPECT_NEAR(figure(moved[0], metric.name), metric.value, 1e-6) << metric.name;
}

TEST(Joint, ShiftsAreThoseOfTheCentre) {
  const auto found =
      motion({turned({0, 0, 0})}, {turned({0, 0, 0}, {-2, -3, -4})}, {{"centre_mm", Numbers{10, 20, 30}}});
  EXPECT_NEAR(figure(found[0], "right_mm"), 2, 1e-9);
  EXPECT_NEAR(figure(found[0], "front_mm"), 3, 1e-9);
  EXPECT_NEAR(figure(found[0], "distraction_mm"), 4, 1e-9);
}

TEST(Joint, TheHelicalAxisSinceTheFirstFrame) {
  // A screw: 40 degrees about and 6 mm along the upward axis.
  const auto found = motion({turned({0, 0, 0}), turned({0, 0, 0})}, {turned({10, 0, 0}), turned({10, 0, 0})});
  EXPECT_NEAR(figure(found[1], "helical_deg"), 0, 1e-6);
  const auto screw = motion({turned({0, 0, 0}), turned({0, 0, 0})}, {turned({0, 0, 5}), turned({0, 0, 45}, {0, 0, 6})});
  EXPECT_NEAR(figure(screw[1], "helical_deg"), 40, 1e-9);
  EXPECT_NEAR(figure(screw[1], "helical_shift_mm"), 6, 1e-9);
}

TEST(Joint, SaysWhatDoesNotFit) {
  const auto refusal = [](const Options& options, std::size_t frames) {
    return shipped::refusal("track.joint",
                            {{"proximal", shipped::list(states({turned({0, 0, 0})}), "frame")},
                             {"distal", shipped::list(states(std::vector(frames, turned({0, 0, 0}))), "frame")}},
                            options);
  };
  EXPECT_EQ(refusal({}, 2), "the two bones are not followed through the same frames: there are 1 and 2");
  EXPECT_EQ(refusal({{"up", Numbers{2, 0, 0}}}, 1), "'right' and 'up' must be two different directions of the CT");
}

}  // namespace marrow::test::joint_test
