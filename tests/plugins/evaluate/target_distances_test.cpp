// SPDX-License-Identifier: Apache-2.0
// Distances of targets in space and in the images, at poses where they follow by hand.
#include "tests/plugins/evaluate/poses.hpp"

namespace marrow::test::target_distances_test {

using namespace known_poses;

TEST(Mtre, OfATranslationIsItsLengthEverywhere) {
  expect_figures(call("evaluate.mtre", {{"pose", item(pose_at({3, 4, 12}))}, {"truth", exact()}, {"model", tool_box()}})
                     .at("metrics"),
                 {{"mtre_mm", 13}, {"rms_mm", 13}, {"max_mm", 13}}, 1e-9);
}

TEST(Mtre, OfAHalfTurnAtLandmarks) {
  // Half a turn about z moves a point by twice its distance from the axis: 6, 8 and 0 mm.
  Landmarks landmarks;
  landmarks.points = {{"a", {3, 0, 5}}, {"b", {0, -4, 9}}, {"c", {0, 0, 20}}};
  Pose pose;
  pose.world_from_model.rotation = Vector3d(-1, -1, 1).asDiagonal();
  expect_figures(
      call("evaluate.mtre", {{"pose", item(pose)}, {"truth", exact()}, {"landmarks", item(landmarks)}}).at("metrics"),
      {{"mtre_mm", 14.0 / 3}, {"rms_mm", std::sqrt(100.0 / 3)}, {"max_mm", 8}}, 1e-12);
}

TEST(Mtre, SaysWhatIsWrong) {
  const auto refusal = [](const Inputs& more) {
    return shipped::refusal("evaluate.mtre", with({{"pose", item(Pose())}, {"truth", exact()}}, more));
  };
  EXPECT_EQ(refusal({}), "there is nothing to measure at; wire a model, whose surface is sampled, or landmarks");
  EXPECT_EQ(refusal({{"landmarks", item(Landmarks())}}),
            "the landmarks have no points in the CT; leave them out to measure on the model's surface");
  Mesh other = box({0, 0, 0}, {1, 1, 1});
  other.frame = "stl";
  EXPECT_EQ(refusal({{"model", item(other)}}),
            "the model is in the frame 'stl', but the pose takes points in 'ct'; give the model that was registered");
  EXPECT_EQ(
      refusal({{"model", item(Mesh{{{0, 0, 0}, {0, 0, 1}, {0, 0, 3}}, {{0, 1, 2}}})}}),
      "model: the surface has no area, as all its triangles are points or lines; check the file or the node that it is "
      "from");
  Pose pose;
  pose.world_from_model.source = "mri";
  EXPECT_EQ(refusal({{"pose", item(pose)}, {"model", tool_box()}}),
            "the pose is world_from_mri, but the truth is world_from_ct; compare poses between the same two frames");
}

// Both distances of van de Kraats et al. (2005) follow from similar triangles.
const std::string kProjection = "evaluate.projection_distance", kReprojection = "evaluate.reprojection_distance";

Inputs inputs(const Pose& pose, const List<View>& views) {
  return {{"pose", item(pose)}, {"truth", exact()}, {"landmarks", origin()}, {"views", each_view(views)}};
}
Value of(const std::string& node, const Pose& pose, const Options& options = {}) {
  return call(node, inputs(pose, two_views()), options).at("metrics");
}

TEST(ProjectionDistance, AcrossTheBeamOfOneViewAlongThatOfTheOther) {
  // 3 mm along x: 3 * 2000 / 600 = 10 px in the frontal view; straight to or from the source in the lateral one.
  expect_figures(of(kProjection, pose_at({3, 0, 0}), {{"source_to_detector_mm", Numbers{1000}}}),
                 {{"frontal_mpd_px", 10},
                  {"frontal_mpd_mm", 3},
                  {"frontal_mpd_detector_mm", 3 * 1000 / 600.0},
                  {"lateral_mpd_px", 0},
                  {"mpd_px", 5},
                  {"mpd_mm", 1.5},
                  {"mpd_detector_mm", 2.5}},
                 1e-9);
}

TEST(ProjectionDistance, OnTheDetectorOnlyWhereItsDistanceIsKnown) {
  EXPECT_TRUE(std::isnan(figure(of(kProjection, pose_at({3, 0, 0})), "mpd_detector_mm")));
  // 3 mm farther from one source, and 3 mm nearer to the other.
  expect_figures(of(kProjection, pose_at({3, 3, 0}), {{"source_to_detector_mm", Numbers{1000, 1200}}}),
                 {{"frontal_mpd_detector_mm", 1000 * 3 / 603.0}, {"lateral_mpd_detector_mm", 1200 * 3 / 597.0}}, 1e-9);
}

TEST(ReprojectionDistance, IsThatOfTheRayAndNotOfThePoint) {
  // The ray to (3, 0, 0) passes the origin at 600 * 3 / hypot(600, 3); the lateral view's ray goes through it.
  const double passed_mm = 600 * 3 / std::hypot(600, 3);
  expect_figures(of(kReprojection, pose_at({3, 0, 0})),
                 {{"frontal_mrpd_mm", passed_mm}, {"lateral_mrpd_mm", 0}, {"mrpd_mm", passed_mm / 2}}, 1e-9);
}

TEST(ReprojectionDistance, OfATurnIsLargerAtTheEndsOfTheSurface) {
  // Seen as a turn in the frontal view.
  const Inputs turned{
      {"pose", item(pose_at({0, 0, 0}, {0, radians(1), 0}))}, {"truth", exact()}, {"model", tool_box()}};
  const auto metrics = call(kReprojection, with(turned, {{"views", each_view(two_views())}})).at("metrics");
  const double mtre_mm = figure(call("evaluate.mtre", turned).at("metrics"), "mtre_mm");
  // All of it lies across the frontal beam, and only the part along z across the lateral one.
  EXPECT_NEAR(figure(metrics, "frontal_mrpd_mm"), mtre_mm, 0.002);
  EXPECT_LT(figure(metrics, "lateral_mrpd_mm"), 0.6 * mtre_mm);
}

TEST(ProjectionDistance, SaysWhatIsWrong) {
  const Pose here;
  for (const std::string& node : {kProjection, kReprojection}) {
    EXPECT_EQ(refusal(node, inputs(here, {})),
              "there is no view to project into; wire the views that the pose was found in");
    EXPECT_EQ(refusal(node, inputs(pose_at({0, -700, 0}), two_views())),
              "view 'frontal': a target does not lie in front of the X-ray source at the pose found");
  }
  EXPECT_EQ(refusal(kProjection, inputs(here, two_views()), {{"source_to_detector_mm", Numbers{1000, 1000, 1000}}}),
            "source_to_detector_mm has 3 numbers, but there are 2 views; give one for all, or one for each");
  EXPECT_EQ(refusal(kProjection, inputs(here, two_views()), {{"source_to_detector_mm", Numbers{-1}}}),
            "source_to_detector_mm: each number must be positive, got -1.000000");
  View behind = two_views()[0];
  behind.camera.camera_from_world.translation_mm.z() = -600;
  EXPECT_EQ(refusal(kProjection, inputs(here, views_named(behind))),
            "view 'frontal': a target does not lie in front of the X-ray source at the true pose; is the truth in "
            "another world frame?");
}

}  // namespace marrow::test::target_distances_test
