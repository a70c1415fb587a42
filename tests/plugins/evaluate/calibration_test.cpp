// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>

#include "shipped.hpp"

namespace calibration_test {

using marrow::Calibration;
using shipped::figure;

Calibration device() {
  Calibration device;
  device.width_px = device.height_px = 1001;
  device.intrinsics << 2000, 0, 500, 0, 2000, 500, 0, 0, 1;
  return device;
}

shipped::Inputs inputs(const Calibration& found, const Calibration& truth) {
  return {{"calibration", shipped::item(found)}, {"true_calibration", shipped::item(truth)}};
}

marrow::Value errors(const Calibration& found, const Calibration& truth) {
  return shipped::call("evaluate.calibration", inputs(found, truth)).at("metrics");
}

TEST(EvaluateCalibration, FiguresByHand) {
  const Calibration truth = device();
  Calibration found = truth;
  found.intrinsics(0, 0) *= 1.001;
  found.intrinsics(1, 1) *= 0.998;
  found.intrinsics(0, 2) += 0.25;
  found.intrinsics(1, 2) -= 0.5;
  found.residual_px = 0.2;
  const marrow::Value metrics = errors(found, truth);
  EXPECT_NEAR(figure(metrics, "focal_error"), 0.2, 1e-9);
  EXPECT_NEAR(figure(metrics, "principal_u_error"), 0.25, 1e-12);
  EXPECT_NEAR(figure(metrics, "principal_v_error"), 0.5, 1e-12);
  EXPECT_NEAR(figure(metrics, "distortion_error"), 0, 1e-9) << "undistorted pixels stay where they are";
  EXPECT_EQ(figure(metrics, "residual"), 0.2);
}

TEST(EvaluateCalibration, DistortionIsTheShiftOfPixelsLessItsMean) {
  // (1 + 0.1 r^2) outwards from a principal point beside the middle, at 21 x 21 places from corner to corner.
  Calibration truth = device();
  truth.height_px = 801;
  truth.intrinsics(0, 2) = 430;
  truth.intrinsics(1, 1) = 1900;
  Calibration found = truth;
  found.distortion.k[0] = 0.1;
  std::vector<Eigen::Vector2d> shifts;
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  for (int row = 0; row <= 20; ++row)
    for (int column = 0; column <= 20; ++column) {
      const Eigen::Vector2d off(50 * column - 430, 40 * row - 500);
      const double r2 = std::pow(off.x() / 2000, 2) + std::pow(off.y() / 1900, 2);
      shifts.push_back(0.1 * r2 * off);
      mean += shifts.back() / 441;
    }
  double squares = 0;
  for (const auto& shift : shifts) squares += (shift - mean).squaredNorm() / 441;
  EXPECT_GT(mean.norm(), 0.1);
  EXPECT_NEAR(figure(errors(found, truth), "distortion_error"), std::sqrt(squares), 1e-9);
}

TEST(EvaluateCalibration, RefusesOtherSizes) {
  Calibration other = device();
  other.width_px = 512;
  EXPECT_EQ(shipped::refusal("evaluate.calibration", inputs(other, device())),
            "the calibration is of images of 512 x 1001 pixels, the truth of 1001 x 1001");
}

}  // namespace calibration_test
