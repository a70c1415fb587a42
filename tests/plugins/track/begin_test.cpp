// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/track/track_state.hpp"
#include "tests/plugins/project/shapes.hpp"

namespace marrow::test::begin_test {

using track::TrackState;

TEST(TrackBegin, TheModelGivesTheAxesOfAStartThatHasNone) {
  Heard listener;
  const Mesh mesh = shapes::cylinder(12, 120);
  Inputs inputs{{"start", item(Pose())}, {"model", item(mesh)}};
  const auto state = output<TrackState>("track.begin", "state", inputs, {}, listener.context);
  EXPECT_TRUE(state.fragment.is_anatomical);
  EXPECT_LT((state.fragment.origin_mm - fragment_frame(mesh).origin_mm).norm(), 1e-9);
  EXPECT_TRUE(listener.warnings.empty());
}

TEST(TrackBegin, SaysThatAStartHasNoAxes) {
  Heard listener;
  const Inputs inputs{{"start", item(Pose())}};
  EXPECT_FALSE(output<TrackState>("track.begin", "state", inputs, {}, listener.context).fragment.is_anatomical);
  ASSERT_EQ(listener.warnings.size(), 1u);
  EXPECT_TRUE(listener.warnings[0].starts_with("the start has no axes of the bone, and no model gives them: "));
}

}  // namespace marrow::test::begin_test
