// SPDX-License-Identifier: Apache-2.0
// A flat square across the beam: how each error of the image moves it is known by hand.
#include "tests/plugins/deviations/square_across_beam.hpp"

namespace marrow::test::systematic_test {

using namespace square_across_beam;

struct Errors {
  double offset_px = 0, camera_px = 0, depth_percent = 0, surface_mm = 0, surface_reach_mm = 10, opaque_mm = 0;
};

Pose added(const Errors& errors) {
  const Mesh model = output<Mesh>("simulate.knee_implant", "mesh", {}, {{"part", "tray"}, {"resolution_mm", 2.0}});
  return output<Pose>("deviations.systematic", "pose",
                      {{"stages", shipped::list(stages(), "stage")},
                       {"model", item(model)},
                       {"projector", projector()},
                       {"views", shipped::list(views(), "view")}},
                      {{"offset_px", errors.offset_px},
                       {"camera_px", errors.camera_px},
                       {"camera_depth_percent", errors.depth_percent},
                       {"surface_mm", errors.surface_mm},
                       {"surface_reach_mm", errors.surface_reach_mm},
                       {"opaque_mm", errors.opaque_mm}});
}

// 1 pixel at 1000 mm is a third of a millimetre.
TEST(Systematic, AnImageThatIsShiftedShiftsTheBodyAcrossTheBeam) {
  const Matrix6d covariance = *added({.camera_px = 1}).covariance;
  EXPECT_NEAR(std::sqrt(covariance(3, 3)), 1 / 3.0, 0.03);
  EXPECT_NEAR(std::sqrt(covariance(4, 4)), 1 / 3.0, 0.03);
}

// An image that is 1 % larger is that of a body that is 1 % nearer.
TEST(Systematic, AMagnificationIsADepth) {
  EXPECT_NEAR(std::sqrt((*added({.depth_percent = 1}).covariance)(5, 5)), 10, 0.3);
}

TEST(Systematic, NoErrorsAddNothing) { EXPECT_EQ(added({}).covariance->norm(), 0); }

double shift_by_surface(double reach_mm) {
  return std::sqrt((*added({.surface_mm = 1, .surface_reach_mm = reach_mm}).covariance)(3, 3));
}

// Each of the 44 points is off by itself. A turn about the beam moves a point along its normal by its distance from the
// middle of its side: -20 to 20 mm in steps of 4. The squares of all sum up to 7040 mm^2.
TEST(Systematic, ErrorsOfSinglePointsOfTheSurfaceCancel) {
  const double turn = std::sqrt((*added({.surface_mm = 1, .surface_reach_mm = 0.1}).covariance)(2, 2));
  EXPECT_NEAR(turn, 1 / std::sqrt(7040.0), 0.05 / std::sqrt(7040.0));
}

// A side as a whole is off by about the same, and the other side by itself: the middle between them by 1 / sqrt(2) mm.
TEST(Systematic, AnErrorOfAWholeSideOfTheSurfaceShiftsTheBody) {
  EXPECT_NEAR(shift_by_surface(15), 1 / std::sqrt(2.0), 0.1);
}

// A surface that is too large everywhere by the same is what the offset common to all edges takes up.
TEST(Systematic, ASurfaceThatIsTooLargeAllAroundShiftsNothing) { EXPECT_LT(shift_by_surface(1000), 0.05); }

// The less opaque the metal may be, the farther inside its edges may lie, and the farther off the pose.
TEST(Systematic, MetalThatLetsRadiationPassIsOneMoreError) {
  const double of_steel = added({.opaque_mm = 1.5}).covariance->norm(),
               of_titanium = added({.opaque_mm = 5}).covariance->norm();
  EXPECT_GT(of_steel, 0);
  EXPECT_GT(of_titanium, of_steel);
}

}  // namespace marrow::test::systematic_test
