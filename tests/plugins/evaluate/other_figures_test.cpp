// SPDX-License-Identifier: Apache-2.0
// Figures of calibrations, sequences, costs, mirror poses and plans for locking.
#include <Eigen/LU>

#include "marrow/toolbox/track/track_state.hpp"
#include "tests/plugins/evaluate/poses.hpp"
#include "tests/plugins/initial/tube.hpp"
#include "tests/plugins/plan/implants.hpp"
#include "tests/plugins/project/shapes.hpp"

namespace marrow::test::other_figures_test {

Calibration device() {
  Calibration device;
  device.width_px = device.height_px = 1001;
  device.intrinsics << 2000, 0, 500, 0, 2000, 500, 0, 0, 1;
  return device;
}
Inputs compared(const Calibration& found, const Calibration& truth) {
  return {{"calibration", item(found)}, {"true_calibration", item(truth)}};
}

TEST(EvaluateCalibration, FiguresByHand) {
  Calibration found = device();
  found.intrinsics(0, 0) *= 1.001;
  found.intrinsics(1, 1) *= 0.998;
  found.intrinsics(0, 2) += 0.25;
  found.intrinsics(1, 2) -= 0.5;
  found.residual_px = 0.2;
  const auto metrics = call("evaluate.calibration", compared(found, device())).at("metrics");
  // Undistorted pixels stay where they are.
  expect_figures(metrics, {{"focal_error", 0.2}, {"distortion_error", 0}}, 1e-9);
  expect_figures(metrics, {{"principal_u_error", 0.25}, {"principal_v_error", 0.5}}, 1e-12);
  expect_figures(metrics, {{"residual", 0.2}}, 0);
}

TEST(EvaluateCalibration, DistortionIsTheShiftOfPixelsLessItsMean) {
  // (1 + 0.1 r^2) outwards from a principal point beside the middle, at 21 x 21 places from corner to corner.
  Calibration truth = device();
  truth.height_px = 801;
  truth.intrinsics(0, 2) = 430;
  truth.intrinsics(1, 1) = 1900;
  Calibration found = truth;
  found.distortion.k[0] = 0.1;
  std::vector<Vector2d> shifts;
  Vector2d mean = Vector2d::Zero();
  for (int row = 0; row <= 20; ++row)
    for (int column = 0; column <= 20; ++column) {
      const Vector2d off(50 * column - 430, 40 * row - 500);
      const double r2 = std::pow(off.x() / 2000, 2) + std::pow(off.y() / 1900, 2);
      shifts.push_back(0.1 * r2 * off);
      mean += shifts.back() / 441;
    }
  double squares = 0;
  for (const auto& shift : shifts) squares += (shift - mean).squaredNorm() / 441;
  EXPECT_GT(mean.norm(), 0.1);
  expect_figures(call("evaluate.calibration", compared(found, truth)).at("metrics"),
                 {{"distortion_error", std::sqrt(squares)}}, 1e-9);
}

TEST(EvaluateCalibration, RefusesOtherSizes) {
  Calibration other = device();
  other.width_px = 512;
  EXPECT_EQ(refusal("evaluate.calibration", compared(other, device())),
            "the calibration is of images of 512 x 1001 pixels, the truth of 1001 x 1001");
}

Inputs frames(const Numbers& values) {
  List<Metrics> list;
  for (std::size_t i = 0; i < values.size(); ++i)
    list.add(std::to_string(i + 1), Metrics{{{"mtre_mm", values[i], "mm"}, {"axial_deg", -values[i], "deg"}}});
  return {{"metrics", shipped::list(list, "frame")}};
}
Value sums(const Inputs& inputs) {
  return call("evaluate.frames", inputs, {{"figures", Strings{"mtre_mm", "axial_deg"}}}).at("metrics");
}

TEST(Frames, AreSummedUp) {
  const Value sum = sums(frames({3, 1, 2, 10, 4}));
  expect_figures(sum, {{"frames", 5}, {"median_mtre_mm", 3}, {"worst_axial_deg", 10}}, 0);  // the sign does not count
  expect_figures(sum, {{"rms_axial_deg", std::sqrt(130 / 5.0)}}, 1e-12);
}

TEST(Frames, HaveQuantilesAsNumpyHasThem) {
  // numpy.quantile([1, 3], [0.5, 0.95]) and of [3, 1, 2, 10]: between two ranks, the value is between theirs.
  expect_figures(sums(frames({1, 3})), {{"median_mtre_mm", 2}, {"p95_mtre_mm", 2.9}}, 1e-12);
  expect_figures(sums(frames({3, 1, 2, 10})), {{"median_axial_deg", 2.5}, {"p95_axial_deg", 8.95}}, 1e-12);
}

TEST(Frames, LostOnesDoNotCount) {
  track::TrackState found, lost;
  found.measured.emplace();
  const Inputs states{{"states", list(named("1", found, "2", lost, "3", found), "frame")}},
      all = with(states, frames({1, 99, 3}));
  expect_figures(sums(all), {{"frames_lost", 1}, {"worst_mtre_mm", 3}}, 0);
  EXPECT_EQ(refusal("evaluate.frames", with(states, frames({1, 99}))),
            "the states are of other frames than the figures: 3 and 2");
  EXPECT_EQ(refusal("evaluate.frames", all, {{"figures", Strings{"mtre"}}}),
            "frame '1' has no figure 'mtre'; there are mtre_mm, axial_deg");
}

/// A bowl about a known pose: squared offset in degrees and mm about a frame.
Value bowl(const RigidTransform& floor, const FragmentFrame& frame) {
  return function<Cost>(cost_of([=](const RigidTransform& pose) {
    const Vector6d motion = motion_between(floor, pose, frame);
    return motion.head<3>().squaredNorm() * degrees(1) * degrees(1) + motion.tail<3>().squaredNorm();
  }));
}

TEST(Landscape, IsTheCostAlongEachAxisOfTheFragment) {
  Pose pose = pose_at({5, 6, 7}, {0.1, -0.2, 0.3});
  pose.frame.origin_mm = {10, 20, 300};
  for (int axis = 0; axis < 6; ++axis) {
    const Truth floor{
        marrow::moved(pose.world_from_model, pose.frame, (axis < 3 ? radians(2.5) : 2.5) * Vector6d::Unit(axis))};
    const auto landscape = output<Landscape>(
        "evaluate.landscape", "landscape",
        {{"cost", bowl(floor.world_from_model, pose.frame)}, {"pose", item(pose)}, {"truth", item(floor)}});
    const auto& profile = landscape.profiles.at(std::size_t(axis));
    EXPECT_EQ(profile.unit, axis < 3 ? "deg" : "mm");
    ASSERT_EQ(profile.costs.size(), 81u);
    EXPECT_NEAR(profile.offsets.front(), -10, 1e-12);
    EXPECT_NEAR(profile.offsets.back(), 10, 1e-12);
    EXPECT_NEAR(profile.costs[50], 0, 1e-9);      // at 2.5, the floor
    EXPECT_NEAR(profile.costs[40], 6.25, 1e-6);   // at the pose itself
    EXPECT_NEAR(profile.costs[80], 56.25, 1e-6);  // 10 - 2.5 squared
    EXPECT_NEAR(profile.truth.value(), 2.5, 1e-9);
  }
}

TEST(Landscape, SpeaksOfTheLongAxisOnlyWhereItIsKnown) {
  const Inputs inputs{{"cost", bowl(placed({0, 0, 0}), {})}, {"pose", item(Pose())}};
  const auto axis_of = [&](const Inputs& more) {
    return output<Landscape>("evaluate.landscape", "landscape", with(inputs, more),
                             {{"profile_points", std::int64_t{3}}})
        .profiles.at(2)
        .axis;
  };
  EXPECT_EQ(axis_of({}), "rotation about the z axis");
  EXPECT_EQ(axis_of({{"model", item(shapes::cylinder(12, 100))}}), "rotation about the long axis");
}

/// The mirror pose of a simulated tray in one view, where the cost has a second, less deep well.
Outputs mirror_of(const RigidTransform& pose, const RigidTransform& expected, double cost) {
  const auto from = [](const RigidTransform& one, const RigidTransform& well) {
    return geodesic_angle_rad(one.rotation, well.rotation) + shift_between_mm(one, well) / 50;
  };
  const auto wells =
      cost_of([=](const RigidTransform& at) { return std::min(1 + from(at, pose), cost + from(at, expected)); });
  return call(
      "evaluate.mirror_pose",
      {{"pose", item(pose_of(pose))},
       {"cost", function<Cost>(wells)},
       {"optimizer", call("optimizer.nelder_mead", {}).at("optimizer")},
       {"model",
        call("simulate.knee_implant", {}, {{"part", "tray"}, {"asymmetry", 0.0}, {"resolution_mm", 1.5}}).at("mesh")},
       {"views", each_view(even_view("only", pinhole(3000, 512, 512), 9))}});
}

// The tray's plane of symmetry is x = 0. A turn by 12 degrees about the image's vertical axis (y) takes it out of the
// line of sight (z); seen along z at the image's middle, the mirror pose has the opposite turn.
TEST(MirrorPose, ATurnOutOfThePlaneChangesItsSign) {
  const RigidTransform upright = placed({0, 0, 900}, {kPi / 2, 0, 0});  // z of the part up in the image
  RigidTransform pose = upright, expected = upright;
  pose.rotation = rotation_from_vector({0, radians(78), 0}) * upright.rotation;
  expected.rotation = rotation_from_vector({0, radians(102), 0}) * upright.rotation;
  const auto out = mirror_of(pose, expected, 1.1);
  EXPECT_LT(turn_between_deg(out.at("pose").as<Pose>().world_from_model, expected), 1);
  expect_figures(out.at("metrics"), {{"mirror_apart_deg", 24}}, 1);
  expect_figures(out.at("metrics"), {{"mirror_times", 1.1}}, 0.02);
}

using geometry::LockingPlan;

/// A plan for a hole at the isocentre along x, whose drill is turned about z and shifted.
LockingPlan plan(double turn_deg, const Vector3d& shift_mm) {
  LockingPlan::Drill drill;
  drill.hole = "distal";
  drill.centre_mm = shift_mm;
  drill.direction = {-std::cos(radians(turn_deg)), -std::sin(radians(turn_deg)), 0};  // its sense does not matter
  drill.beta_deg = 90;
  LockingPlan plan;
  plan.drills = {drill};
  return plan;
}
Inputs planned(const LockingPlan& plan) {
  return {{"plan", item(plan)},
          {"implant", item(implants::rod())},
          {"truth", item(Truth{implants::pose({0, 0, 0}, {0, 0, 50}, {0, 0, 0}).world_from_model})}};
}
Value errors(const LockingPlan& plan) { return call("evaluate.locking", planned(plan)).at("metrics"); }

TEST(EvaluateLocking, AngleOffsetAndView) {
  // An offset along the axis does not count. At 90 degrees the rays run along x.
  expect_figures(errors(plan(0.8, {7, 0.3, 0.4})),
                 {{"angle_deg", 0.8}, {"offset_mm", 0.5}, {"view_deg", 0}, {"off", 0}}, 1e-9);
  LockingPlan turned = plan(0, {0, 0, 0});
  turned.drills[0].beta_deg = 88.5;
  expect_figures(errors(turned), {{"view_deg", 1.5}}, 1e-9);
  turned.isocentre_mm = {0, 0, 600};  // then the ray to the hole is oblique
  expect_figures(errors(turned), {{"view_deg", 45.02}}, 0.01);
}

TEST(EvaluateLocking, SilentIsOffAndNotDoubted) {
  LockingPlan off = plan(1.2, {0, 0, 0});
  expect_figures(errors(off), {{"off", 1}, {"silent", 1}}, 0);
  off.drills[0].doubts = {"doubtful"};
  expect_figures(errors(off), {{"silent", 0}, {"flagged", 1}}, 0);
  expect_figures(errors(plan(0, {0, 0.6, 0})), {{"silent", 1}}, 0);
}

TEST(EvaluateLocking, RefusesAPlanForAnotherImplant) {
  LockingPlan other = plan(0, {0, 0, 0});
  other.drills[0].hole = "proximal";
  EXPECT_EQ(refusal("evaluate.locking", planned(other)),
            "evaluate.locking: the plan has a drill for hole 'proximal', but the implant has no such hole; give the "
            "implant of the plan");
}

}  // namespace marrow::test::other_figures_test

// Two millimetres in the patient are two millimetres, whatever the shape of a pixel. The figures follow from similar
// triangles: at 600 mm a pixel is 0.3 mm wide and 1.2 mm high.
namespace marrow::test::pixels_not_square_test {

using namespace known_poses;

/// Looks along +y from 600 mm before the world's origin: u runs along x, v against z.
View view() {
  View view = even_view("frontal", two_views()[0].camera);
  view.camera.intrinsics(1, 1) = 500;
  return view;
}

TEST(PixelsNotSquare, ProjectionDistances) {
  const auto of = [](const Pose& pose) {
    return call("evaluate.projection_distance",
                {{"pose", item(pose)}, {"truth", exact()}, {"landmarks", origin()}, {"views", each_view(view())}},
                {{"source_to_detector_mm", Numbers{1000}}})
        .at("metrics");
  };
  expect_figures(of(pose_at({2, 0, 0})), {{"mpd_mm", 2}}, 1e-9);
  expect_figures(of(pose_at({0, 0, 2})), {{"mpd_mm", 2}, {"mpd_px", 2 / 1.2}}, 1e-9);
  expect_figures(of(pose_at({3, 0, 4})), {{"mpd_mm", 5}, {"mpd_detector_mm", 5 * 1000 / 600.0}}, 1e-9);
}

/// Of an outline of one point at the world's origin, with its normal along u or v.
double outline_distance_mm(bool along_u, float edge_px) {
  const float u = along_u ? 1.0f : 0.0f, v = 1 - u;
  const EdgeMap edges{512, 512, {{256 + u * edge_px, 256 + v * edge_px, u, v, 10}}};
  const auto projector = outline_of([=](const Camera&, const RigidTransform&, double) {
    return std::vector<OutlinePoint>{{256, 256, u, v, Eigen::Vector3f::Zero()}};
  });
  return figure(call("evaluate.outline_distance", {{"pose", item(Pose())},
                                                   {"projector", function<OutlineProjector>(projector)},
                                                   {"views", each_view(view())},
                                                   {"edges", per_view("frontal", edges)}})
                    .at("metrics"),
                "median_mm");
}

TEST(PixelsNotSquare, OutlineDistances) {
  EXPECT_NEAR(outline_distance_mm(true, 10), 10 * 0.3, 1e-6);
  EXPECT_NEAR(outline_distance_mm(false, 10), 10 * 1.2, 1e-6);
  EXPECT_NEAR(outline_distance_mm(true, 100), 30 * 0.3, 1e-6) << "no edge within reach: the reach itself";
  EXPECT_NEAR(outline_distance_mm(false, 100), 30 * 1.2, 1e-6);
}

// A cylinder of 28 mm that is inclined in the image, so that width and angle depend on the shape of the pixels. Its
// borders are the true ones, turned by a degree in the patient.
TEST(PixelsNotSquare, BordersOfAShaft) {
  constexpr double kRadius_mm = 14;
  const RigidTransform inclined = placed({0, 0, 0}, {0, 0.5, 0});
  const ShaftLines exact = tube::borders(view().camera, {0, 0, 0}, inclined.rotation.col(2), kRadius_mm, 230, 282);
  const auto figure = [&](const ShaftLines& lines, const std::string& name) {
    return shipped::figure(
        call("evaluate.shaft_lines", {{"lines", item(lines)},
                                      {"view", item(view())},
                                      {"models", per_fragment("distal", tube::cylinder(kRadius_mm, 100))},
                                      {"truths", per_fragment("distal", Truth{inclined})}})
            .at("metrics"),
        name);
  };
  // At the depth of the outline, kRadius^2 / 600 before the axis, the borders are 2 (600 - that) tan(half) apart, where
  // the source sees the cylinder at an angle of twice asin(kRadius / 600).
  EXPECT_NEAR(figure(exact, "true_width_mm"),
              2 * (600 - kRadius_mm * kRadius_mm / 600) * std::tan(std::asin(kRadius_mm / 600)), 0.06)
      << "the mesh has 180 sides, so its outline is up to a millimetre nearer or deeper";
  EXPECT_NEAR(figure(exact, "width_error_mm"), 0, 0.02);
  ShaftLines turned = exact;
  const Eigen::Matrix2d mm_from_px = Vector2d(0.3, 1.2).asDiagonal();
  const Vector2d middle = 0.5 * (exact.left.from_px + exact.left.to_px);
  for (Vector2d* end : {&turned.left.from_px, &turned.left.to_px})
    *end = middle + mm_from_px.inverse() * Eigen::Rotation2Dd(radians(1)) * mm_from_px * (*end - middle);
  EXPECT_NEAR(figure(turned, "border_angle_deg"), 1, 0.02);
}

}  // namespace marrow::test::pixels_not_square_test
