// SPDX-License-Identifier: Apache-2.0
// A flat square across the beam: how each error of the image moves it is known by hand.
#include <gtest/gtest.h>

#include "tests/plugins/deviations/square_across_beam.hpp"

namespace systematic_test {

using namespace marrow;
using namespace square_across_beam;

Pose added(double offset_px, double camera_px, double depth_percent) {
  const Mesh model =
      shipped::call("simulate.knee_implant", {}, {{"part", "tray"}, {"resolution_mm", 2.0}}).at("mesh").as<Mesh>();
  return shipped::call("deviations.systematic",
                       {{"stages", shipped::list(stages(), "stage")},
                        {"model", shipped::item(model)},
                        {"projector", projector()},
                        {"views", shipped::list(views(), "view")}},
                       {{"offset_px", offset_px}, {"camera_px", camera_px}, {"camera_depth_percent", depth_percent}})
      .at("pose")
      .as<Pose>();
}

// 1 pixel at 1000 mm is a third of a millimetre.
TEST(Systematic, AnImageThatIsShiftedShiftsTheBodyAcrossTheBeam) {
  const Matrix6d covariance = *added(0, 1, 0).covariance;
  EXPECT_NEAR(std::sqrt(covariance(3, 3)), 1 / 3.0, 0.03);
  EXPECT_NEAR(std::sqrt(covariance(4, 4)), 1 / 3.0, 0.03);
}

// An image that is 1 % larger is that of a body that is 1 % nearer.
TEST(Systematic, AMagnificationIsADepth) { EXPECT_NEAR(std::sqrt((*added(0, 0, 1).covariance)(5, 5)), 10, 0.3); }

TEST(Systematic, NoErrorsAddNothing) { EXPECT_EQ(added(0, 0, 0).covariance->norm(), 0); }

}  // namespace systematic_test
