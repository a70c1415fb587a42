// SPDX-License-Identifier: Apache-2.0
// Calibrations that determine their focal length well, hardly, or not at all.
#include <gtest/gtest.h>

#include "marrow/base/error.hpp"
#include "marrow/camera/determined.hpp"

namespace determined_test {

std::string said_of(double deviation_u_px, double deviation_v_px) {
  marrow::Calibration calibration;
  calibration.intrinsics.diagonal() << 800, 1000, 1;
  calibration.focal_deviation_px = {deviation_u_px, deviation_v_px};
  try {
    return marrow::calibration::doubtful_focal_length(calibration, "the images");
  } catch (const marrow::Error& error) {
    return std::string("refused: ") + error.what();
  }
}

TEST(FocalLength, IsDoubtfulAboveAHundredthOfItselfAndRefusedAboveATenth) {
  const std::string remedy = "; take the board tilted by 20 degrees or more, to another side in each";
  EXPECT_EQ(said_of(8, 10), "");
  EXPECT_EQ(said_of(9, 10),
            "the images hardly tell the focal length: it is 800 px, known to 9 px (one standard deviation)" + remedy);
  EXPECT_EQ(said_of(8, 101),
            "refused: the images hardly tell the focal length: it is 1000 px, known to 101 px (one standard "
            "deviation)" +
                remedy);
  EXPECT_TRUE(said_of(std::nan(""), 1).starts_with("refused: ")) << "nothing determines it";
}

}  // namespace determined_test
