// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "marrow/simulate/posture.hpp"
#include "nodes.hpp"

namespace bone_motion_test {

using namespace marrow;
using phantom::Phantom;

TEST(BoneMotion, IsAsFarAsAskedHalfAPeriodLater) {
  const auto femur = simulated::femur({});
  const auto whole = shipped::call("simulate.whole", {{"bone", shipped::item(femur)}}).at("phantom");
  // A period of 1 s at 8 Hz: frame 3 is a quarter of it, frame 5 a half, frame 9 all of it.
  const auto frames = shipped::call("simulate.bone_motion", {{"phantom", whole}},
                                    {{"frames", std::int64_t(9)},
                                     {"frame_rate_hz", 8.0},
                                     {"period_s", 1.0},
                                     {"rotation_deg", std::vector<double>{0, 0, 40}},
                                     {"translation_mm", std::vector<double>{0, 0, 7}}})
                          .at("postures")
                          .as_list<phantom::Posture>();
  ASSERT_EQ(frames.names().back(), "0009");
  const auto& rest = whole.as<Phantom>().fragments[0];
  const auto motion = [&](std::size_t frame) {
    return motion_between(rest.world_from_ct, frames[frame].world_from_ct[0], rest.frame);
  };
  EXPECT_LT(motion(0).norm(), 1e-9);
  EXPECT_NEAR(degrees(motion(2)[2]), 20, 1e-6);
  EXPECT_NEAR(motion(2)[5], 7, 1e-6);
  EXPECT_NEAR(degrees(motion(4)[2]), 40, 1e-6);
  EXPECT_NEAR(motion(4)[5], 0, 1e-6);
  EXPECT_LT(motion(8).norm(), 1e-6);
  EXPECT_LT(motion(4).head<2>().norm(), 1e-9) << "about the long axis only";
}

}  // namespace bone_motion_test
