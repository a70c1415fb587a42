// SPDX-License-Identifier: Apache-2.0
#include "plugins/evaluate/calibration.cpp"

#include <gtest/gtest.h>

namespace {

Calibration device() {
  Calibration device;
  device.width_px = device.height_px = 1001;
  device.intrinsics << 2000, 0, 500, 0, 2000, 500, 0, 0, 1;
  return device;
}

double value(const marrow::Metrics& metrics, const std::string& name) {
  for (const auto& item : metrics.items)
    if (item.name == name) return item.value;
  ADD_FAILURE() << name;
  return 0;
}

TEST(EvaluateCalibration, FiguresByHand) {
  const Calibration truth = device();
  Calibration found = truth;
  found.intrinsics(0, 0) *= 1.001;
  found.intrinsics(1, 1) *= 0.998;
  found.intrinsics(0, 2) += 0.25;
  found.intrinsics(1, 2) -= 0.5;
  found.residual_px = 0.2;
  const marrow::Metrics metrics = calibration_error(found, truth);
  EXPECT_NEAR(value(metrics, "focal_error"), 0.2, 1e-9);
  EXPECT_NEAR(value(metrics, "principal_u_error"), 0.25, 1e-12);
  EXPECT_NEAR(value(metrics, "principal_v_error"), 0.5, 1e-12);
  EXPECT_NEAR(value(metrics, "distortion_error"), 0, 1e-9) << "undistorted pixels stay where they are";
  EXPECT_EQ(value(metrics, "residual"), 0.2);
  found = truth;
  found.distortion.k[0] = 0.1;  // at (500, 0) px from the middle: r = 0.25, shift = 500 * 0.1 / 16
  const double far = 500 * 0.1 / 16;
  EXPECT_GT(value(calibration_error(found, truth), "distortion_error"), 0.5 * far);
  EXPECT_LT(value(calibration_error(found, truth), "distortion_error"), 2.9 * far);
}

TEST(EvaluateCalibration, RefusesOtherSizes) {
  Calibration other = device();
  other.width_px = 512;
  try {
    calibration_error(other, device());
    FAIL();
  } catch (const marrow::Error& error) {
    EXPECT_STREQ(error.what(), "the calibration is of images of 512 x 1001 pixels, the truth of 1001 x 1001");
  }
}

}  // namespace
