// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "shipped.hpp"
#include "tests/plugins/evaluate/listener.hpp"
#include "tests/plugins/project/shapes.hpp"

#include "marrow/toolbox/track/track_state.hpp"

namespace begin_test {

using marrow::track::TrackState;

TEST(TrackBegin, TheModelGivesTheAxesOfAStartThatHasNone) {
  listener::Listener listener;
  const marrow::Mesh mesh = shapes::cylinder(12, 120);
  shipped::Inputs inputs{{"start", shipped::item(marrow::Pose())}, {"model", shipped::item(mesh)}};
  const auto state = shipped::call("track.begin", inputs, {}, listener.context).at("state").as<TrackState>();
  EXPECT_TRUE(state.fragment.is_anatomical);
  EXPECT_LT((state.fragment.origin_mm - marrow::fragment_frame(mesh).origin_mm).norm(), 1e-9);
  EXPECT_TRUE(listener.warnings.empty());
}

TEST(TrackBegin, SaysThatAStartHasNoAxes) {
  listener::Listener listener;
  const shipped::Inputs inputs{{"start", shipped::item(marrow::Pose())}};
  EXPECT_FALSE(
      shipped::call("track.begin", inputs, {}, listener.context).at("state").as<TrackState>().fragment.is_anatomical);
  ASSERT_EQ(listener.warnings.size(), 1u);
  EXPECT_TRUE(listener.warnings[0].starts_with("the start has no axes of the bone, and no model gives them: "));
}

}  // namespace begin_test
