// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/geometry/camera_deviations.hpp"
#include "tests/plugins/deviations/square_across_beam.hpp"

namespace marrow::test::deviations_cameras_test {

using namespace square_across_beam;
using geometry::CameraDeviations;

Inputs inputs(const CameraDeviations& stated, const std::string& view = "only") {
  List<CameraDeviations> list;
  list.add(view, stated);
  return {{"stages", shipped::list(stages(), "stage")},
          {"projector", projector()},
          {"views", shipped::list(views(), "view")},
          {"camera_deviations", shipped::list(list, "view")}};
}

/// The standard deviation of the pose about (0 to 2, in degrees) or along (3 to 5, in mm) an axis.
double added(const CameraDeviations& stated, int axis) {
  const Pose pose = output<Pose>("deviations.cameras", "pose", inputs(stated));
  return std::sqrt((*pose.covariance)(axis, axis)) * (axis < 3 ? degrees(1) : 1);
}

// In one view a pose goes wherever its camera sends it. The body lies at 1000 mm, where a pixel is a third of a mm.
TEST(DeviationsOfCameras, EachErrorMovesThePoseAsMuchAsTheCamera) {
  CameraDeviations focal, centre, source, shift, turn;
  focal.focal_percent = 5, centre.centre_px = 30, source.source_mm = 20, shift.shift_mm = 3, turn.turn_deg = 1;
  EXPECT_NEAR(added(focal, 5), 50, 1.5);
  EXPECT_NEAR(added(centre, 3), 30 / std::sqrt(2.0) / 3, 0.5);
  EXPECT_NEAR(added(source, 5), 20, 0.2);
  EXPECT_NEAR(added(shift, 4), std::sqrt(3.0), 0.02);
  EXPECT_NEAR(added(turn, 2), 1 / std::sqrt(3.0), 0.01);
  focal.focal_percent = 3, focal.source_mm = 40;
  EXPECT_NEAR(added(focal, 5), 50, 1.5) << "independent errors";
}

TEST(DeviationsOfCameras, NothingStatedAddsNothing) {
  const Pose found = output<Pose>("deviations.cameras", "pose", inputs({}));
  EXPECT_EQ(hash_of(found), hash_of(pose()));
}

TEST(DeviationsOfCameras, SaysWhatIsWrong) {
  EXPECT_EQ(refusal("deviations.cameras", inputs({}, "frontal")),
            "camera_deviations and views are not of the same views; wire both from the node that reads the views");
}

// What the cameras add is known in mm, so the factors that were fitted to residuals do not multiply it.
TEST(DeviationsOfCameras, AreAddedToCalibratedOnesWithoutTheirFactors) {
  List<Pose> narrow = stages(), wide;
  Pose pose = narrow[0];
  pose.frame = fragment_frame(test::box({1, 2, 3}, {20, 30, 100}));
  pose.covariance = Matrix6d::Identity();
  narrow = {};
  narrow.add("final", pose);
  (*pose.covariance)(3, 3) += 100;
  wide.add("final", pose);
  Inputs all{{"stages", shipped::list(narrow, "stage")},
             {"widened", shipped::list(wide, "stage")},
             {"model", item(test::box({1, 2, 3}, {20, 30, 100}))}};
  const Options options{{"translation_factors", Numbers{2, 2, 2}}};
  const Pose found = output<Pose>("deviations.calibrated", "pose", all, options);
  EXPECT_NEAR((*found.covariance)(3, 3), 4 + 100, 1e-9);
  EXPECT_NEAR((*found.covariance)(4, 4), 4, 1e-9);
  all["widened"] = shipped::list(named("first", pose), "stage");
  EXPECT_EQ(refusal("deviations.calibrated", all, options),
            "widened and stages are not the same poses; wire the stages of the node that got these stages");
}

}  // namespace marrow::test::deviations_cameras_test
