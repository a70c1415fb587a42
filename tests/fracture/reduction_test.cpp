// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>

#include "poses.hpp"

namespace reduction_test {

using shipped::figure;

TEST(Reduction, BringsTheFragmentBackBesideTheOther) {
  const auto poses = fracture_poses::displaced({4, -3, 12, 6, -2, 9});
  const shipped::Outputs result = shipped::call("fracture.reduction", fracture_poses::inputs(poses));
  const auto& found = result.at("pose").as<marrow::Pose>().world_from_model;
  const marrow::Value& motion = result.at("motion");
  EXPECT_TRUE(found.rotation.isApprox(poses[0].world_from_model.rotation, 1e-12));
  EXPECT_TRUE(found.translation_mm.isApprox(poses[0].world_from_model.translation_mm, 1e-12));
  EXPECT_NEAR(figure(motion, "shift_mm"), std::sqrt(36 + 4 + 81), 1e-9);
  // The motion that is told, applied in the world about the fragment's middle, does the same.
  const Eigen::Vector3d turn_deg(figure(motion, "turn_x_deg"), figure(motion, "turn_y_deg"),
                                 figure(motion, "turn_z_deg"));
  const Eigen::Vector3d shift(figure(motion, "shift_x_mm"), figure(motion, "shift_y_mm"), figure(motion, "shift_z_mm"));
  EXPECT_NEAR(turn_deg.norm(), figure(motion, "turn_deg"), 1e-9);
  const Eigen::Matrix3d turn = marrow::rotation_from_vector(marrow::radians(1) * turn_deg);
  const Eigen::Vector3d middle = poses[1].world_from_model * poses[1].frame.origin_mm;
  for (const Eigen::Vector3d& point : {Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(10, -5, 90)})
    EXPECT_TRUE((middle + turn * (poses[1].world_from_model * point - middle) + shift)
                    .isApprox(poses[0].world_from_model * point, 1e-9));
}

}  // namespace reduction_test
