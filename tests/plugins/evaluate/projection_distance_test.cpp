// SPDX-License-Identifier: Apache-2.0
// Both distances of van de Kraats et al. (2005) at poses where they follow from similar triangles.
#include <gtest/gtest.h>

#include "tests/plugins/evaluate/poses.hpp"

namespace projection_distance_test {

using namespace known_poses;

const std::string kProjection = "evaluate.projection_distance", kReprojection = "evaluate.reprojection_distance";

marrow::Value of(const std::string& node, const marrow::Pose& pose, const shipped::Options& options = {}) {
  return shipped::call(node,
                       {{"pose", shipped::item(pose)},
                        {"truth", exact()},
                        {"landmarks", origin()},
                        {"views", views_of(two_views())}},
                       options)
      .at("metrics");
}

TEST(ProjectionDistance, AcrossTheBeamOfOneViewAlongThatOfTheOther) {
  // 3 mm along x: 3 * 2000 / 600 = 10 px in the frontal view; straight to or from the source in the lateral one.
  const auto metrics = of(kProjection, shifted(3, 0, 0), {{"source_to_detector_mm", std::vector<double>{1000}}});
  EXPECT_NEAR(shipped::figure(metrics, "frontal_mpd_px"), 10, 1e-9);
  EXPECT_NEAR(shipped::figure(metrics, "frontal_mpd_mm"), 3, 1e-9);
  EXPECT_NEAR(shipped::figure(metrics, "frontal_mpd_detector_mm"), 3 * 1000 / 600.0, 1e-9);
  EXPECT_NEAR(shipped::figure(metrics, "lateral_mpd_px"), 0, 1e-9);
  EXPECT_NEAR(shipped::figure(metrics, "mpd_px"), 5, 1e-9);
  EXPECT_NEAR(shipped::figure(metrics, "mpd_mm"), 1.5, 1e-9);
  EXPECT_NEAR(shipped::figure(metrics, "mpd_detector_mm"), 2.5, 1e-9);
}

TEST(ProjectionDistance, OnTheDetectorOnlyWhereItsDistanceIsKnown) {
  EXPECT_TRUE(std::isnan(shipped::figure(of(kProjection, shifted(3, 0, 0)), "mpd_detector_mm")));
  const auto metrics = of(kProjection, shifted(3, 3, 0), {{"source_to_detector_mm", std::vector<double>{1000, 1200}}});
  EXPECT_NEAR(shipped::figure(metrics, "frontal_mpd_detector_mm"), 1000 * 3 / 603.0, 1e-9)
      << "3 mm further from the source";
  EXPECT_NEAR(shipped::figure(metrics, "lateral_mpd_detector_mm"), 1200 * 3 / 597.0, 1e-9) << "3 mm nearer to it";
}

TEST(ReprojectionDistance, IsThatOfTheRayAndNotOfThePoint) {
  // The ray to (3, 0, 0) passes the origin at 600 * 3 / hypot(600, 3); the lateral view's ray goes through it.
  const auto metrics = of(kReprojection, shifted(3, 0, 0));
  EXPECT_NEAR(shipped::figure(metrics, "frontal_mrpd_mm"), 600 * 3 / std::hypot(600, 3), 1e-9);
  EXPECT_NEAR(shipped::figure(metrics, "lateral_mrpd_mm"), 0, 1e-9);
  EXPECT_NEAR(shipped::figure(metrics, "mrpd_mm"), 300 * 3 / std::hypot(600, 3), 1e-9);
}

TEST(ReprojectionDistance, OfATurnIsLargerAtTheEndsOfTheSurface) {
  marrow::Pose pose;
  pose.world_from_model.rotation =
      marrow::rotation_from_vector({0, marrow::radians(1), 0});  // seen as a turn in the frontal view
  const auto metrics =
      shipped::call(
          kReprojection,
          {{"pose", shipped::item(pose)}, {"truth", exact()}, {"model", tool_box()}, {"views", views_of(two_views())}})
          .at("metrics");
  const auto mtre =
      shipped::call("evaluate.mtre", {{"pose", shipped::item(pose)}, {"truth", exact()}, {"model", tool_box()}})
          .at("metrics");
  // All of it lies across the frontal beam, and only the part along z across the lateral one.
  EXPECT_NEAR(shipped::figure(metrics, "frontal_mrpd_mm"), shipped::figure(mtre, "mtre_mm"), 0.002);
  EXPECT_LT(shipped::figure(metrics, "lateral_mrpd_mm"), 0.6 * shipped::figure(mtre, "mtre_mm"));
}

TEST(ProjectionDistance, SaysWhatIsWrong) {
  const auto refusal = [](const std::string& node, const marrow::Pose& pose, const marrow::List<marrow::View>& views,
                          const shipped::Options& options = {}) {
    return shipped::refusal(
        node, {{"pose", shipped::item(pose)}, {"truth", exact()}, {"landmarks", origin()}, {"views", views_of(views)}},
        options);
  };
  for (const std::string& node : {kProjection, kReprojection}) {
    EXPECT_EQ(refusal(node, shifted(0, 0, 0), {}),
              "there is no view to project into; wire the views that the pose was found in");
    EXPECT_EQ(refusal(node, shifted(0, -700, 0), two_views()),
              "view 'frontal': a target does not lie in front of the X-ray source at the pose found");
  }
  EXPECT_EQ(refusal(kProjection, shifted(0, 0, 0), two_views(),
                    {{"source_to_detector_mm", std::vector<double>{1000, 1000, 1000}}}),
            "source_to_detector_mm has 3 numbers, but there are 2 views; give one for all, or one for each");
  EXPECT_EQ(refusal(kProjection, shifted(0, 0, 0), two_views(), {{"source_to_detector_mm", std::vector<double>{-1}}}),
            "source_to_detector_mm: each number must be positive, got -1.000000");
  marrow::List<marrow::View> far;
  for (marrow::View view : two_views()) {
    view.camera.camera_from_world.translation_mm.z() = -600;
    far.add(view.name, view);
  }
  EXPECT_EQ(refusal(kProjection, shifted(0, 0, 0), far),
            "view 'frontal': a target does not lie in front of the X-ray source at the true pose; is the truth in "
            "another world frame?");
}

}  // namespace projection_distance_test
