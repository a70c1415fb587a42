// SPDX-License-Identifier: Apache-2.0
#include "tests/plugins/evaluate/poses.hpp"

namespace marrow::test::pose_error_test {

using Eigen::AngleAxisd;

// A shaft away from the origin with its long axis oblique in the frame's y-z plane. By the convention of FragmentFrame
// its frontal axis is +x and its lateral axis (0, 0.6, 0.8) x (1, 0, 0) = (0, 0.8, -0.6).
const Vector3d kCentre(40, -30, 250), kLong(0, 0.6, 0.8), kFrontal(1, 0, 0), kLateral(0, 0.8, -0.6);

Mesh shaft() { return cylinder(kCentre, kLong, 10, 100, 64); }

const Truth kTruth{
    {"world", "ct", AngleAxisd(0.7, Vector3d(1, 2, 3).normalized()).toRotationMatrix(), Vector3d(-12, 55, 8)}};

/// The truth after the model itself was turned about its centre and shifted, both given in the model's frame.
Pose displaced(double angle_deg, const Vector3d& axis, const Vector3d& shift_mm = Vector3d::Zero()) {
  const Matrix3d turn = AngleAxisd(radians(angle_deg), axis).toRotationMatrix();
  const RigidTransform& exact = kTruth.world_from_model;
  return pose_of({"world", "ct", exact.rotation * turn, exact * (kCentre - turn * kCentre + shift_mm)});
}

Inputs inputs(const Pose& pose, const Truth& truth, const Mesh& model) {
  return {{"pose", item(pose)}, {"truth", item(truth)}, {"model", item(model)}};
}
Metrics metrics_of(const Pose& pose, const Truth& truth = kTruth) {
  return output<Metrics>("evaluate.pose_error", "metrics", inputs(pose, truth, shaft()));
}
Figures errors(const Pose& pose, const Truth& truth = kTruth) { return figures_of(item(metrics_of(pose, truth))); }

TEST(PoseError, IsZeroAtTheTruth) {
  for (const auto& [name, value] : errors(displaced(0, kLong))) EXPECT_NEAR(value, 0, 1e-9) << name;
}

TEST(PoseError, AxialRotationStaysAxial) {
  const Figures error = errors(displaced(1, kLong));
  expect_figures(error, {{"rotation_deg", 1}, {"axial_deg", 1}, {"translation_mm", 0}}, 1e-9);
  expect_figures(error, {{"frontal_deg", 0}, {"lateral_deg", 0}, {"chapter_rotation_deg", 1.0 / 3}}, 1e-6);
  // Chord 2 sin(0.5 deg) times the mean distance from the axis: side 2 pi 10 * 100 at 10 mm, ends 2 pi 10^2 at 20/3 mm.
  EXPECT_NEAR(error.at("mtre_mm"), 2 * std::sin(radians(0.5)) * (2000 * 10 + 200 * 20.0 / 3) / 2200, 1e-3);
}

TEST(PoseError, TellsFrontalFromLateral) {
  Figures error = errors(displaced(-2, kFrontal));
  expect_figures(error, {{"frontal_deg", -2}}, 1e-9);
  expect_figures(error, {{"lateral_deg", 0}}, 1e-6);
  error = errors(displaced(3, kLateral));
  expect_figures(error, {{"lateral_deg", 3}, {"rotation_deg", 3}}, 1e-9);
  expect_figures(error, {{"frontal_deg", 0}}, 1e-6);
}

TEST(PoseError, TranslationIsSplitAlongAndAcrossTheShaft) {
  const Figures error = errors(displaced(0, kLong, 3 * kFrontal - 4 * kLateral + 12 * kLong));
  expect_figures(error, {{"translation_mm", 13}, {"mtre_mm", 13}, {"rotation_deg", 0}}, 1e-9);
  expect_figures(error,
                 {{"along_mm", 12},
                  {"across_mm", 5},
                  {"along_frontal_mm", 3},
                  {"along_lateral_mm", -4},
                  {"chapter_translation_mm", (3 + 4 + 12) / 3.0}},
                 1e-6);
}

TEST(PoseError, RotationAboutTheWorldOriginMovesTheCentroid) {
  // Turning by 1 degree about an axis 250 mm away shifts the centroid by the chord, though the rotation is the same.
  const Figures error = errors(pose_at({0, 0, 0}, {0, 0, radians(1)}), {});
  EXPECT_NEAR(error.at("rotation_deg"), 1, 1e-9);
  EXPECT_NEAR(error.at("translation_mm"), 2 * std::sin(radians(0.5)) * 50, 1e-6);  // hypot(40, 30) from the z axis
}

TEST(PoseError, CombinedMotion) {
  const Figures error = errors(displaced(1.5, kLong, 2 * kLong));
  expect_figures(error, {{"axial_deg", 1.5}}, 1e-9);
  expect_figures(error, {{"along_mm", 2}, {"across_mm", 0}}, 1e-6);
}

TEST(PoseError, PredictedDeviationAboutTheFragmentsOwnAxes) {
  Pose pose = displaced(0, kLong);
  pose.frame = fragment_frame(shaft());
  pose.covariance = Matrix6d(Vector6d{1e-6, 4e-6, 25e-6, 0.01, 0.04, 0.09}.asDiagonal());
  expect_figures(errors(pose),
                 {{"predicted_frontal_deg", degrees(0.001)},
                  {"predicted_lateral_deg", degrees(0.002)},
                  {"predicted_axial_deg", degrees(0.005)},
                  {"predicted_max_deg", degrees(0.005)},
                  {"predicted_along_mm", 0.3},
                  {"predicted_max_mm", 0.3}},
                 1e-9);
}

TEST(PoseError, PredictionIsCarriedToTheCentroid) {
  // 1 mrad about the model frame's x axis at a point 100 mm below the centroid is 0.1 mm at the centroid.
  Pose pose = displaced(0, kLong);
  pose.frame.origin_mm = kCentre - Vector3d(0, 0, 100);
  pose.covariance = Matrix6d(Vector6d{1e-6, 0, 0, 0, 0, 0}.asDiagonal());
  // The shift is along -y, and the long axis has 0.6 of y.
  expect_figures(errors(pose),
                 {{"predicted_max_mm", 0.1}, {"predicted_frontal_deg", degrees(0.001)}, {"predicted_along_mm", 0.06}},
                 1e-9);
}

TEST(PoseError, NoPredictionWithoutAFiniteCovariance) {
  Pose pose = displaced(0, kLong);
  EXPECT_EQ(errors(pose).count("predicted_axial_deg"), 0u);
  pose.covariance = Matrix6d::Constant(std::nan(""));
  EXPECT_EQ(errors(pose).count("predicted_axial_deg"), 0u);
}

TEST(PoseError, UnitsFollowTheNames) {
  for (const auto& item : metrics_of(displaced(1, kLong, kLong)).items)
    EXPECT_EQ(item.unit, item.name.substr(item.name.rfind('_') + 1)) << item.name;
}

TEST(PoseError, SaysWhatIsWrong) {
  const auto refusal = [](const Pose& pose, const Mesh& model) {
    return shipped::refusal("evaluate.pose_error", inputs(pose, {}, model));
  };
  Pose pose;
  pose.world_from_model.source = "mri";
  EXPECT_EQ(refusal(pose, shaft()),
            "the pose is world_from_mri, but the truth is world_from_ct; compare poses between the same two frames");
  Mesh model = shaft();
  model.frame = "stl";
  EXPECT_EQ(refusal({}, model),
            "the model is in the frame 'stl', but the pose takes points in 'ct'; give the model that was registered");
  EXPECT_EQ(refusal(pose_at({0, std::nan(""), 0}), shaft()), "pose: the transform has a number that is not finite");
  EXPECT_EQ(refusal({}, {}), "fragment frame: the surface has no triangles");
}

}  // namespace marrow::test::pose_error_test

// Distances of targets in space and in the images, at poses where they follow by hand.
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
  EXPECT_EQ(refusal({{"model", item(Mesh{{{0, 0, 0}, {0, 0, 1}, {0, 0, 3}}, {{0, 1, 2}}})}}),
            "model: the surface has no area, as all its triangles are points or lines; check the file or the node that "
            "it is from");
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

// How far two poses are apart, and what a reduction by two found poses leaves open.
namespace marrow::test::two_poses_test {

/// A bar of 20 x 20 x 100 mm, sawn through at its middle.
const Mesh kLower = box({0, 0, -25}, {20, 20, 50}), kUpper = box({0, 0, 25}, {20, 20, 50});

TEST(PoseDifference, OfATurnAndAShift) {
  const auto metrics = call("evaluate.pose_difference", {{"pose", item(pose_at({0, 0, -5}, {0, 0, radians(10)}))},
                                                         {"reference", item(Pose())},
                                                         {"model", item(kLower)}})
                           .at("metrics");
  // What holds for one point by hand holds for all points of the surface: how far a point turns depends on its distance
  // from the axis.
  double sum = 0;
  for (const Vector3d& point : sample_surface(kLower, 500))
    sum += std::hypot(5.0, 2 * std::sin(radians(5)) * point.head<2>().norm()) / 500;
  EXPECT_GT(sum, 5);
  EXPECT_LT(sum, std::hypot(5.0, radians(10) * 15));
  expect_figures(metrics,
                 {{"rotation_deg", 10},
                  {"axial_deg", 10},
                  {"frontal_deg", 0},
                  {"lateral_deg", 0},
                  {"translation_mm", 5},
                  {"x_mm", 0},
                  {"y_mm", 0},
                  {"z_mm", -5},
                  {"distance_mm", sum}},
                 1e-9);
}

TEST(PoseDifference, RefusesPosesOfOtherFrames) {
  Pose other;
  other.world_from_model.source = "mri";
  EXPECT_EQ(
      refusal("evaluate.pose_difference",
              {{"pose", item(Pose())}, {"reference", item(other)}, {"model", item(kLower)}}),
      "the pose is world_from_ct, but the reference is world_from_mri; compare poses between the same two frames");
}

template <class T>
Value both(const T& lower, const T& upper) {
  return per_fragment("distal", lower, "proximal", upper);
}

/// The lower half is found at one place and lies at another. The upper one is found where it lies.
Inputs halves(const RigidTransform& found, const RigidTransform& truth,
              const RigidTransform& upper = placed({0, 0, 0})) {
  return {{"poses", both(pose_of(found), pose_of(upper))},
          {"truths", both(Truth{truth}, Truth{upper})},
          {"models", both(kLower, kUpper)}};
}
Value gap(const Inputs& inputs, const Options& options = {}) {
  return call("evaluate.reduction_gap", inputs, options).at("metrics");
}

// The lower half truly lies 8 mm to the side and is found there: the reduction closes the gap.
TEST(ReductionGap, ExactPosesCloseIt) {
  const auto metrics = gap(halves(placed({8, 0, 0}), placed({8, 0, 0}), placed({5, 5, 5}, {0, 0, 0.3})));
  EXPECT_GT(figure(metrics, "before_mm"), 5);
  expect_figures(metrics, {{"gap_mm", 0}, {"largest_gap_mm", 0}}, 1e-9);
  expect_figures(metrics, {{"rotation_deg", 0}}, 1e-5);
}

// Found 0.5 mm too high: the reduction leaves it 0.5 mm too low, all over.
TEST(ReductionGap, AnErrorOfAPoseStaysOpen) {
  expect_figures(gap(halves(placed({8, 0, 0.5}), placed({8, 0, 0}))),
                 {{"before_mm", 8}, {"gap_mm", 0.5}, {"largest_gap_mm", 0.5}, {"translation_mm", 0.5}}, 1e-9);
}

// Found turned by 2 degrees about x through the fracture. The gap that stays open is this turn of the fracture's
// points, which lie up to 10 mm to the side and, on the walls, up to border_mm below the cut.
TEST(ReductionGap, OfATurnIsWhatTheFractureShows) {
  for (const double border_mm : {3.0, 8.0}) {
    const auto metrics =
        gap(halves(placed({0, 0, 0}, {radians(2), 0, 0}), placed({0, 0, 0})), {{"border_mm", border_mm}});
    const double turn = 2 * std::sin(radians(1));
    expect_figures(metrics, {{"rotation_deg", 2}, {"before_mm", 0}}, 1e-9);
    EXPECT_NEAR(figure(metrics, "largest_gap_mm"), turn * std::hypot(10, border_mm), 0.02 * turn * 10);
    // The cut itself (20 x 20, mean |y| of 5), and walls: two at |y| = 10, two at any y, from 0 down to nearly
    // border_mm.
    const auto mean_at = [&](auto y_of) {
      double sum = 0;
      for (int i = 0; i < 200; ++i)
        for (int k = 0; k < 200; ++k) sum += std::hypot(y_of((i + 0.5) / 200), border_mm * (k + 0.5) / 200) / 40000;
      return sum;
    };
    const double walls = 40 * border_mm, mean = (400 * 5 + walls * mean_at([](double) { return 10.0; }) +
                                                 walls * mean_at([](double share) { return 10 * share; })) /
                                                (400 + 2 * walls);
    EXPECT_NEAR(figure(metrics, "gap_mm"), turn * mean, 0.02 * turn * mean);
    EXPECT_NEAR(figure(metrics, "translation_mm"), 25 * turn, 1e-6) << "the centroid lies 25 mm below";
  }
}

TEST(ReductionGap, SaysWhatIsWrong) {
  const std::string node = "evaluate.reduction_gap";
  const Inputs good = halves(placed({0, 0, 0}), placed({0, 0, 0}));
  EXPECT_EQ(refusal(node, good, {{"moved", std::string("middle")}}),
            "there is no pose of a fragment 'middle', only of distal, proximal; name both fragments with moved and "
            "reference");
  EXPECT_EQ(refusal(node, with(good, {{"models", both(kLower, box({0, 0, 35}, {20, 20, 30}))}})),
            "the surfaces of 'distal' and 'proximal' are nowhere within border_mm of each other; are they the two "
            "sides of one fracture? If so, raise border_mm");
  Pose elsewhere;
  elsewhere.world_from_model.source = "atlas";
  for (const Value& poses : {both(elsewhere, Pose()), both(Pose(), elsewhere)})
    EXPECT_EQ(
        refusal(node, with(good, {{"poses", poses}})),
        "the pose is world_from_atlas, but the truth is world_from_ct; compare poses between the same two frames");
}

}  // namespace marrow::test::two_poses_test
