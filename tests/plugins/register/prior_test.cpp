// SPDX-License-Identifier: Apache-2.0
// A registration by a cost with a prior.
#include <gtest/gtest.h>

#include "bowl.hpp"
#include "shipped.hpp"

namespace prior_test {

using marrow::Cost, marrow::Matrix6d, marrow::Pose, marrow::Vector6d;

/// Squared deviations, from degrees and mm to radians and mm.
Matrix6d squares(const Vector6d& deg_and_mm) {
  Vector6d deviations = deg_and_mm;
  deviations.head<3>() *= marrow::radians(1);
  return deviations.cwiseAbs2().asDiagonal();
}

// The images say 0 degrees about the long axis, with a variance of noise_times, as their blocks show only one; the
// prior says 2, with a variance of 4. Two normal densities multiply to one with the sum of their weights 1 / variance,
// and with the mean of their means by these weights.
TEST(Prior, ThePoseLiesBetweenImagesAndPriorWithTheDeviationOfBoth) {
  const Pose at = well::truth();
  Vector6d found, known;
  found << 0.1, 0.1, 1, 0.1, 0.1, 0.1;
  known << 20, 20, 2, 50, 50, 50;
  const Matrix6d hessian = found.cwiseAbs2().cwiseInverse().asDiagonal();
  Pose images = at, prior = well::pose_at(at, 0, 0, 2, 0, 0, 0);
  images.covariance = squares(found);
  prior.covariance = squares(known);
  const shipped::Inputs inputs{
      {"cost", marrow::Value::of<Cost>(std::make_shared<const well::Bowl>(at.world_from_model, at.frame, hessian))},
      {"prior", shipped::item(prior)},
      {"found", shipped::item(images)}};
  for (const double noise_times : {1.0, 2.0, 4.0}) {
    const auto made =
        shipped::call("similarity.with_prior", inputs, {{"degrees_of_freedom", 1000.0}, {"noise_times", noise_times}});
    const Pose pose = shipped::call("register.multiresolution",
                                    {{"cost", made.at("cost")},
                                     {"optimizer", shipped::call("optimizer.nelder_mead", {}).at("optimizer")},
                                     {"start", shipped::item(at)}},
                                    {{"scan_rotation_deg", 0.0},
                                     {"scan_translation_mm", 0.0},
                                     {"candidates", std::int64_t(1)},
                                     {"step_tolerance", std::vector<double>{0.1, 0.1, 0.003}}})
                          .at("pose")
                          .as<Pose>();
    const Vector6d off = well::way(at.world_from_model, pose.world_from_model, at.frame);
    const double variance = 1 / (1 / noise_times + 1 / 4.0);
    EXPECT_NEAR(off[2], variance * 2 / 4.0, 0.02) << noise_times;
    EXPECT_NEAR(marrow::degrees(std::sqrt((*pose.covariance)(2, 2))), std::sqrt(variance), 0.04) << noise_times;
  }
}

}  // namespace prior_test
