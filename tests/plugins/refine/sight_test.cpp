// SPDX-License-Identifier: Apache-2.0
#include "plugins/refine/sight.hpp"
#include "tests/harness/node_test.hpp"

namespace marrow::test::sight_test {

View view_at_600_mm() {
  View view;
  view.camera.intrinsics << 2000, 0, 100, 0, 500, 100, 0, 0, 1;
  view.camera.camera_from_world.translation_mm = {0, 0, 600};
  return view;
}

// At 600 mm, 5 px of root mean square are 5 / sqrt(2) px along u and along v: 3.54 * 0.3 mm and 3.54 * 1.2 mm. The
// shift of 1 mm is 1 / sqrt(3) along each axis. A tenth of the shift by the principal point, 5 px * 0.3 mm, is the
// limit of the model, and so is 0.001 mm.
TEST(Sight, AnErrorOfTheCentreIsInMillimetresAlongEachAxis) {
  const auto deviation = refine::sight_of(view_at_600_mm(), {0, 0, 0}, {}).deviation();
  const double shift2 = (1 + 1e-6 + 0.15 * 0.15) / 3;
  EXPECT_NEAR(deviation[3], std::sqrt(shift2 + 12.5 * 0.3 * 0.3), 1e-12);
  EXPECT_NEAR(deviation[4], std::sqrt(shift2 + 12.5 * 1.2 * 1.2), 1e-12);
  EXPECT_NEAR(deviation[5], std::sqrt(shift2 + 36), 1e-12) << "1 % of 600 mm";
}

// The ray through a pixel 1 px to the right turns by 1 / 2000 about v. So a bone that is seen from the same side has
// turned as much, and has moved by 600 / 2000 mm.
TEST(Sight, AnErrorOfTheCentreTurnsTheBoneAboutTheSource) {
  const auto sight = refine::sight_of(view_at_600_mm(), {0, 0, 0}, {.turn_deg = 0, .shift_mm = 0});
  EXPECT_NEAR(sight.covariance(1, 3), 12.5 * degrees(1 / 2000.0) * 0.3, 1e-12);
  EXPECT_NEAR(sight.covariance(0, 4), -12.5 * degrees(1 / 500.0) * 1.2, 1e-12);
}

TEST(Sight, WhatIsStatedAboutACameraTakesThePlaceOfWhatIsExpected) {
  geometry::CameraDeviations stated;
  stated.focal_percent = 5, stated.source_mm = 40;
  const refine::Sight sight = refine::sight_of(view_at_600_mm(), {0, 0, 0}, {}, stated);
  EXPECT_NEAR(sight.deviation()[5], std::sqrt((1 + 1e-6 + 0.15 * 0.15) / 3 + 900 + 1600), 1e-9);
  EXPECT_NEAR(sight.covariance(1, 3), 12.5 * degrees(1 / 2000.0) * 0.3, 1e-12) << "the centre as expected";
}

TEST(Sight, NumbersAreTheInverseOfTheMotion) {
  const refine::Sight sight = refine::sight_of(view_at_600_mm(), {3, -8, 20}, {});
  Vector6d numbers;
  numbers << 12, -7, 4, 10, -20, 30;
  EXPECT_LT((sight.numbers(sight.motion(numbers)) - numbers).norm(), 1e-9);
}

}  // namespace marrow::test::sight_test
