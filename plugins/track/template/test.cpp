// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <marrow/testing/node.hpp>

#include "marrow/toolbox/track/track_state.hpp"

namespace node_test = marrow::node_test;
namespace track = marrow::track;

TEST(NewNode, KeepsABoneOfConstantVelocityOnItsWay) {
  marrow::List<track::TrackState> states;
  track::TrackState state;
  state.frame_rate_hz = 10;
  state.now.velocity_per_s[5] = 20;  // mm/s along z: 2 mm a frame
  for (int i = 0; i < 8; ++i) {
    const node_test::Outputs before = node_test::call("track.predict", {{"state", node_test::item(state)}});
    marrow::Pose seen;
    seen.world_from_model.translation_mm = {0, 0, 2.0 * (i + 1)};
    seen.covariance = 1e-2 * marrow::Matrix6d::Identity();
    const node_test::Outputs after =
        node_test::call("track.filter", {{"state", before.at("state")}, {"pose", node_test::item(seen)}});
    state = after.at("state").as<track::TrackState>();
    states.add(marrow::track::frame_name(std::size_t(i) + 1), state);
  }
  const auto poses = node_test::call("track.new_node", {{"states", node_test::list(states, "frame")}})
                         .at("poses")
                         .as_list<marrow::Pose>();
  ASSERT_EQ(poses.size(), 8u);
  for (std::size_t i = 0; i < 8; ++i)
    EXPECT_NEAR(poses[i].world_from_model.translation_mm.z(), 2.0 * (double(i) + 1), 1e-6);
}
