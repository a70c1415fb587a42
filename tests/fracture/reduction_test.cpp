// SPDX-License-Identifier: Apache-2.0
#include "plugins/fracture/reduction.cpp"

#include "poses.hpp"

TEST(Reduction, BringsTheFragmentBackBesideTheOther) {
  const auto poses = displaced({4, -3, 12, 6, -2, 9});
  const Reduction result = reduction(poses, {});
  EXPECT_TRUE(result.pose.world_from_model.rotation.isApprox(poses[0].world_from_model.rotation, 1e-12));
  EXPECT_TRUE(result.pose.world_from_model.translation_mm.isApprox(poses[0].world_from_model.translation_mm, 1e-12));
  EXPECT_NEAR(figure(result.motion, "shift_mm"), std::sqrt(36 + 4 + 81), 1e-9);
  // The motion that is told, applied in the world about the fragment's middle, does the same.
  const Eigen::Vector3d turn_deg(figure(result.motion, "turn_x_deg"), figure(result.motion, "turn_y_deg"),
                                 figure(result.motion, "turn_z_deg"));
  const Eigen::Vector3d shift(figure(result.motion, "shift_x_mm"), figure(result.motion, "shift_y_mm"),
                              figure(result.motion, "shift_z_mm"));
  EXPECT_NEAR(turn_deg.norm(), figure(result.motion, "turn_deg"), 1e-9);
  const Eigen::Matrix3d turn = marrow::rotation_from_vector(marrow::radians(1) * turn_deg);
  const Eigen::Vector3d middle = poses[1].world_from_model * poses[1].frame.origin_mm;
  for (const Eigen::Vector3d& point : {Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(10, -5, 90)})
    EXPECT_TRUE((middle + turn * (poses[1].world_from_model * point - middle) + shift)
                    .isApprox(poses[0].world_from_model * point, 1e-9));
}
