// SPDX-License-Identifier: Apache-2.0
// The long axis is that of the bone's surface, whatever axes a pose came with. A box lies along an oblique direction.
// Its covariance is given about the CT's axes; what it means about the box's own follows by hand: both have the same
// origin, so C' = Q C Q^T of each 3 x 3 block, with the box's axes in the columns of Q.
#include "tests/plugins/verdict/wells.hpp"

namespace marrow::test::long_axis_test {

using wells::figure;

/// Turns z into an oblique direction.
Matrix3d turn() { return rotation_from_vector({0.5, -0.6, 0.2}); }

/// 20 x 24 x 100 mm about the origin, along the third column of turn().
Mesh oblique_box() {
  Mesh mesh;
  for (const double z : {-50, 50})
    for (const double y : {-12, 12})
      for (const double x : {-10, 10}) mesh.vertices_mm.push_back(turn() * Vector3d(x, y, z));
  mesh.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                    {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  return mesh;
}

/// A pose about the CT's axes whose deviation about the box's long axis is given; 0.05 degrees and mm else.
Pose known_to(double axial_deg) {
  constexpr double kOther = 0.05;
  Vector6d variance = Vector6d::Constant(kOther * kOther);
  variance.head<3>() *= radians(1) * radians(1);
  variance[2] = std::pow(radians(axial_deg), 2);
  Matrix6d q = Matrix6d::Zero();
  q.topLeftCorner<3, 3>() = q.bottomRightCorner<3, 3>() = turn();
  Pose pose;
  pose.world_from_model.translation_mm = {5, -3, 700};
  pose.covariance = q * variance.asDiagonal() * q.transpose();
  return pose;
}

Verdict verdict_on(const Pose& pose, const Pose* prior = nullptr) {
  Inputs inputs{{"pose", item(pose)}, {"model", item(oblique_box())}};
  if (prior) inputs["prior"] = item(*prior);
  return output<Verdict>("verdict.predicted", "verdict", inputs);
}

TEST(LongAxis, ThePredictedDeviationIsAboutTheBonesAxis) {
  // About the CT's z the deviation is only sqrt(sum_k Q_zk^2 v_k).
  EXPECT_NEAR(figure(verdict_on(known_to(0.624)), "predicted_axial_deg"), 0.624, 0.02);
  const Verdict verdict = verdict_on(known_to(4));
  EXPECT_NEAR(figure(verdict, "predicted_axial_deg"), 4, 0.1);
  // 21.1 % of a normal distribution lie beyond 5 / 4 deviations.
  EXPECT_NEAR(verdict.failure_probability, 0.211, 0.02);
  EXPECT_EQ(verdict.reasons.at(0), "the rotation about the long axis is known to 4.0 degrees only");
}

TEST(LongAxis, SoIsTheDifferenceFromAPrior) {
  const Pose pose = known_to(3);
  Pose prior = known_to(5);
  prior.world_from_model.rotation = rotation_from_vector(radians(12) * turn().col(2));
  const Verdict verdict = verdict_on(pose, &prior);
  EXPECT_NEAR(figure(verdict, "prior_axial_deg"), 12, 1e-6);
  EXPECT_NEAR(figure(verdict, "prior_axial_deviations"), 12 / std::sqrt(25.0 - 9.0), 1e-6);
}

TEST(LongAxis, APriorMayHaveOtherAxesThanThePose) {
  const Pose pose = known_to(3), prior = known_to(5);
  const Pose turned = in_frame(prior, {Vector3d(30, -20, 100), rotation_from_vector({1, 2, -1})});
  EXPECT_NEAR(figure(verdict_on(pose, &turned), "prior_axial_deviations"), 0, 1e-6);
  Pose away = turned;
  away.world_from_model.rotation = rotation_from_vector(radians(12) * turn().col(2));
  EXPECT_NEAR(figure(verdict_on(pose, &away), "prior_axial_deviations"), 12 / std::sqrt(25.0 - 9.0), 1e-6);
}

}  // namespace marrow::test::long_axis_test
