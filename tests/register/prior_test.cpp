// SPDX-License-Identifier: Apache-2.0
// A registration by a cost with a prior.
#include <gtest/gtest.h>

#include "bowl.hpp"
#include "shipped.hpp"

namespace prior_test {

using marrow::Cost, marrow::Matrix6d, marrow::Pose, marrow::Vector6d;

Pose truth() {
  Pose pose;
  pose.frame = {Eigen::Vector3d(5, -3, 80), marrow::rotation_from_vector({0.1, -0.2, 0.3})};
  pose.world_from_model = {"world", "ct", marrow::rotation_from_vector({0.2, 0.1, -0.4}), Eigen::Vector3d(12, -7, 30)};
  return pose;
}

/// Squared deviations, from degrees and mm to radians and mm.
Matrix6d squares(const Vector6d& deg_and_mm) {
  Vector6d deviations = deg_and_mm;
  deviations.head<3>() *= marrow::radians(1);
  return deviations.cwiseAbs2().asDiagonal();
}

TEST(Prior, ThePoseLiesBetweenImagesAndPriorWithTheDeviationOfBoth) {
  // The images say 0 degrees about the long axis, with a deviation of 1; the prior says 2, with a deviation of 2 which
  // counts as 2 / sqrt(2), because a unit of the prior counts twice. So the pose is at 2 / (1 + 2) = 0.667 degrees and
  // its variance is (1 / 1^2 + 2^2 / 2^2 / 1) / (1 + 2 / 2^2)^2 with the weights 1 and 2 / 2^2.
  const Pose at = truth();
  Vector6d found;
  found << 0.1, 0.1, 1, 0.1, 0.1, 0.1;
  Matrix6d hessian = Matrix6d(found.cwiseAbs2().cwiseInverse().asDiagonal());
  Pose images = at, prior = well::pose_at(at, 0, 0, 2, 0, 0, 0);
  images.covariance = squares(found);
  Vector6d known;
  known << 20, 20, 2, 50, 50, 50;
  prior.covariance = squares(known);
  shipped::Inputs inputs{
      {"cost", marrow::Value::of<Cost>(std::make_shared<const well::Bowl>(at.world_from_model, at.frame, hessian))},
      {"prior", shipped::item(prior)},
      {"found", shipped::item(images)}};
  const auto made = shipped::call("similarity.with_prior", inputs, {{"degrees_of_freedom", 1000.0}});
  const Pose pose =
      shipped::call("register.multiresolution",
                    {{"cost", made.at("cost")},
                     {"optimizer", shipped::call("optimizer.nelder_mead", {}).at("optimizer")},
                     {"initial", shipped::item(at)}},
                    {{"scan_rotation_deg", 0.0}, {"scan_translation_mm", 0.0}, {"candidates", std::int64_t(1)}})
          .at("pose")
          .as<Pose>();
  const Vector6d off = well::way(at.world_from_model, pose.world_from_model, at.frame);
  const double weight = 2 / 4.0;
  EXPECT_NEAR(off[2], 2 * weight / (1 + weight), 0.02);
  // The images' residuals scatter by 1; those of the prior by its own deviation, twice counted.
  const double variance = (1 + 4 * weight * weight) / ((1 + weight) * (1 + weight));
  EXPECT_NEAR(marrow::degrees(std::sqrt((*pose.covariance)(2, 2))), std::sqrt(variance), 0.03);
}

}  // namespace prior_test
