// SPDX-License-Identifier: Apache-2.0
#include "plugins/refine/sight.hpp"

#include <gtest/gtest.h>

namespace sight_test {

// At 600 mm, 5 px of root mean square are 5 / sqrt(2) px along u and along v: 3.54 * 0.3 mm and 3.54 * 1.2 mm. The
// shift of 1 mm is 1 / sqrt(3) along each axis.
TEST(Sight, AnErrorOfTheCentreIsInMillimetresAlongEachAxis) {
  marrow::View view;
  view.camera.intrinsics << 2000, 0, 100, 0, 500, 100, 0, 0, 1;
  view.camera.camera_from_world.translation_mm = {0, 0, 600};
  const auto deviation = marrow::refine::sight_of(view, {0, 0, 0}, {}).deviation;
  EXPECT_NEAR(deviation[3], std::hypot(1 / std::sqrt(3.0), 5 / std::sqrt(2.0) * 0.3), 1e-12);
  EXPECT_NEAR(deviation[4], std::hypot(1 / std::sqrt(3.0), 5 / std::sqrt(2.0) * 1.2), 1e-12);
}

}  // namespace sight_test
