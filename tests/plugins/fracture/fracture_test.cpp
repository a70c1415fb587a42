// SPDX-License-Identifier: Apache-2.0
#include "marrow/fracture/fracture_site.hpp"

#include "marrow/toolbox/phantom/phantom.hpp"
#include "tests/harness/node_test.hpp"

namespace marrow::test::fracture_test {

// A broken shaft whose measures are known: two tubes in the CT, one above the other.

/// Its fracture rises by tan(30 degrees) to the patient's left, and a gap of 2 mm is in its middle.
constexpr double kRadius_mm = 14, kRise = 0.57735, kGap_mm = 2;
const Vector3d kFracture_mm(3, -4, 180);

/// A closed tube that ends at the fracture, above (+1) or below it (-1).
Mesh tube(double side, double length_mm) {
  Mesh mesh = phantom::tube({0, 0, 0}, {0, 0, length_mm}, kRadius_mm, 96);
  for (Vector3d& vertex : mesh.vertices_mm) {
    if (vertex.z() < 1e-6) vertex.z() += side * kRise * vertex.x();
    vertex.z() = side * (0.5 * kGap_mm + vertex.z());
  }
  if (side < 0)
    for (auto& triangle : mesh.triangles) std::swap(triangle[0], triangle[1]);
  for (Vector3d& vertex : mesh.vertices_mm) vertex += kFracture_mm;
  mesh.frame = "ct";
  return mesh;
}

List<Mesh> models() { return named("proximal", tube(1, 160), "distal", tube(-1, 120)); }

/// Where the proximal fragment is in the images.
RigidTransform place() { return {"world", "ct", rotation_from_vector({0.4, -0.2, 0.6}), {10, -20, 30}}; }

/// Both poses with their fragments' own axes. The distal fragment has moved in the CT by `motion`.
List<Pose> poses(const RigidTransform& motion) {
  List<Pose> both;
  for (const std::string name : {"proximal", "distal"}) {
    Pose pose;
    pose.frame = fragment_frame(*models().find(name));
    pose.world_from_model = name == "distal" ? place() * motion : place();
    both.add(name, pose);
  }
  return both;
}

/// The same poses as from files that hold only a matrix.
List<Pose> without_axes(const List<Pose>& given) {
  return given.changed([](Pose& pose, std::size_t) { pose.frame = {}; });
}

/// A rotation about a point of the CT, then a shift.
RigidTransform motion(const Matrix3d& turn, const Vector3d& about_mm = kFracture_mm,
                      const Vector3d& shift_mm = Vector3d::Zero()) {
  return {"ct", "ct", turn, about_mm - turn * about_mm + shift_mm};
}

Matrix3d turn(double degrees, const Vector3d& axis) {
  return Eigen::AngleAxisd(degrees * std::acos(-1) / 180, axis).toRotationMatrix();
}

Inputs inputs(const List<Pose>& poses) {
  return {{"poses", shipped::list(poses, "fragment")}, {"models", shipped::list(models(), "fragment")}};
}

List<Pose> displaced() {
  return poses(motion(turn(14, Vector3d(0.2, -0.5, 0.8).normalized()), {5, 3, 60}, {6, -2, 9}));
}

TEST(Reduction, BringsTheFragmentBackBesideTheOther) {
  const auto given = displaced();
  const Outputs result = call("fracture.reduction", inputs(given));
  const auto& found = result.at("pose").as<Pose>().world_from_model;
  const Value& moved = result.at("metrics");
  EXPECT_TRUE(found.rotation.isApprox(given[0].world_from_model.rotation, 1e-12));
  EXPECT_TRUE(found.translation_mm.isApprox(given[0].world_from_model.translation_mm, 1e-12));
  EXPECT_NEAR(figure(moved, "turn_deg"), 14, 1e-9);
  // The motion that is told, applied in the world about the fragment's middle, does the same.
  const Vector3d turn_deg(figure(moved, "turn_x_deg"), figure(moved, "turn_y_deg"), figure(moved, "turn_z_deg"));
  const Vector3d shift(figure(moved, "shift_x_mm"), figure(moved, "shift_y_mm"), figure(moved, "shift_z_mm"));
  EXPECT_NEAR(turn_deg.norm(), figure(moved, "turn_deg"), 1e-9);
  EXPECT_NEAR(shift.norm(), figure(moved, "shift_mm"), 1e-9);
  const Matrix3d whole = rotation_from_vector(radians(1) * turn_deg);
  const Vector3d middle = given[1].world_from_model * given[1].frame.origin_mm;
  for (const Vector3d& point : {Vector3d(0, 0, 0), Vector3d(10, -5, 90)})
    EXPECT_TRUE((middle + whole * (given[1].world_from_model * point - middle) + shift)
                    .isApprox(given[0].world_from_model * point, 1e-9));
}

TEST(Reduction, IsAboutTheFragmentsMiddleEvenIfThePoseDoesNotSayWhereThatIs) {
  // Turned about its own middle, so nothing is to be shifted. About the CT's origin it would be tens of mm.
  const Vector3d middle_mm = fragment_frame(*models().find("distal")).origin_mm;
  const auto given = without_axes(poses(motion(turn(20, Vector3d::UnitX()), middle_mm)));
  const auto found = call("fracture.reduction", inputs(given));
  EXPECT_NEAR(figure(found.at("metrics"), "shift_mm"), 0, 1e-9);
  EXPECT_EQ(found.at("pose").as<Pose>().frame.origin_mm, middle_mm);
  Inputs without = inputs(given);
  without.erase("models");
  EXPECT_EQ(
      refusal("fracture.reduction", without),
      "the pose of 'distal' does not say where the fragment's middle is and how its long axis runs, as a matrix alone "
      "does not; wire the surfaces of both fragments to 'models', or give the node that reads the pose its model");
}

// The motions are made from the right values: a hinge, an angle in a plane, a turn about the shaft.

/// The fragment's own axes. Its oblique end tilts them by 1.5 degrees.
const Matrix3d kAxes = fragment_frame(*models().find("distal")).axes;
const Vector3d kLeft = kAxes.col(0), kBack = kAxes.col(1), kUp = kAxes.col(2);

/// How near the fracture's middle is found on the surfaces.
constexpr double kNear_mm = 0.1;

Value misalignment(const RigidTransform& motion, const Options& options = {{"side", "left"}}) {
  return call("fracture.misalignment", inputs(poses(motion)), options).at("metrics");
}

TEST(Misalignment, AHingeWithTheBoneEndsInContactIsNoShift) {
  const auto found = misalignment(motion(turn(10, kBack)));
  EXPECT_NEAR(figure(found, "angulation_deg"), 10, 0.05);
  EXPECT_NEAR(figure(found, "shift_mm"), 0, kNear_mm);
  EXPECT_NEAR(figure(found, "shortening_mm"), 0, kNear_mm);
  EXPECT_NEAR(figure(found, "internal_torsion_deg"), 0, 0.05);
}

TEST(Misalignment, AngulationAndTorsionDoNotMix) {
  const Matrix3d tilt = turn(15, kAxes * Vector3d(0.6, 0.8, 0));
  for (const Matrix3d& whole : {Matrix3d(tilt * turn(40, kUp)), Matrix3d(turn(40, kUp) * tilt)}) {
    const auto found = misalignment(motion(whole));
    EXPECT_NEAR(figure(found, "angulation_deg"), 15, 0.1);
    EXPECT_NEAR(figure(found, "internal_torsion_deg"), -40, 0.1) << "the front turns to the left, which is outwards";
  }
  EXPECT_NEAR(figure(misalignment(motion(turn(170, kUp))), "internal_torsion_deg"), -170, 0.1);
  EXPECT_NEAR(figure(misalignment(motion(turn(-170, kUp))), "internal_torsion_deg"), 170, 0.1);
}

/// One figure of each motion, for a left and for a right limb, by hand: medial is to the right of a left limb.
TEST(Misalignment, SignsAreThoseOfTheirNamesOnBothSides) {
  struct Case {
    RigidTransform motion;
    std::string name;
    double left, right;
  };
  const auto shift = [](const Vector3d& by_mm) { return motion(Matrix3d::Identity(), Vector3d::Zero(), by_mm); };
  // A turn of 8 degrees about the axis to the back brings the lower end to the right: inwards on the left side.
  // One about the axis to the left brings the lower end to the back, with the apex in front.
  const std::vector<Case> cases{
      {motion(turn(8, kBack)), "varus_deg", 8, -8},          {motion(turn(8, kLeft)), "procurvatum_deg", 8, 8},
      {motion(turn(8, kUp)), "internal_torsion_deg", -8, 8}, {shift(5 * kLeft), "medial_shift_mm", -5, 5},
      {shift(5 * kBack), "anterior_shift_mm", -5, -5},       {shift(5 * kUp), "shortening_mm", 5, 5}};
  for (const Case& one : cases)
    for (const std::string side : {"left", "right"}) {
      const Value found = misalignment(one.motion, {{"side", side}});
      for (const Metric& metric : found.as<Metrics>().items) {
        if (metric.name == "angulation_deg" || metric.name == "shift_mm") continue;
        const double right = metric.name == one.name ? (side == "left" ? one.left : one.right) : 0;
        EXPECT_NEAR(metric.value, right, 0.15) << one.name << ", " << side << ": " << metric.name;
      }
    }
  const auto unknown = misalignment(motion(turn(8, kBack)), {});
  EXPECT_NEAR(figure(unknown, "apex_left_deg"), 8, 0.1);
  EXPECT_NEAR(figure(misalignment(motion(turn(8, kUp)), {}), "torsion_left_deg"), 8, 0.1);
  EXPECT_NEAR(figure(misalignment(shift(5 * kLeft), {}), "left_shift_mm"), 5, 0.1);
  EXPECT_TRUE(std::isnan(figure(unknown, "varus_deg"))) << "nobody may say what is varus";
}

/// An X-ray from the front shows the frontal angle, one from the side the sagittal one: of the shaft's direction (tan
/// f, tan s, 1), which is put in.
TEST(Misalignment, PlanesAreThoseOfTheXRays) {
  const double frontal = 12 * kPi / 180, sagittal = -20 * kPi / 180;
  const Vector3d shaft = Vector3d(std::tan(frontal), std::tan(sagittal), 1).normalized();
  const Matrix3d swing = Eigen::Quaterniond::FromTwoVectors(kUp, kAxes * shaft).toRotationMatrix();
  const auto found = misalignment(motion(swing * turn(-25, kUp), kFracture_mm, kAxes * Vector3d(-6, 2, -4)));
  expect_figures(found,
                 {{"varus_deg", 12},
                  {"procurvatum_deg", 20},
                  {"angulation_deg", std::acos(shaft.z()) * 180 / kPi},
                  {"internal_torsion_deg", 25}},
                 0.1);
  EXPECT_NEAR(figure(found, "medial_shift_mm"), 6, 2 * kNear_mm);
  EXPECT_NEAR(figure(found, "anterior_shift_mm"), -2, 2 * kNear_mm);
  EXPECT_NEAR(figure(found, "shift_mm"), std::hypot(6, 2), 2 * kNear_mm);
  EXPECT_NEAR(figure(found, "shortening_mm"), -4, 2 * kNear_mm) << "drawn apart";
}

TEST(Misalignment, NoneWhereNothingMoved) {
  const auto found = misalignment(motion(Matrix3d::Identity()));
  for (const Metric& metric : found.as<Metrics>().items) EXPECT_NEAR(metric.value, 0, 1e-9) << metric.name;
}

TEST(Misalignment, IsOfTheDistalFragmentWhicheverIsNamedFirst) {
  const RigidTransform moved = motion(turn(8, kBack) * turn(20, kUp), kFracture_mm, {1, 2, 3});
  const auto one = misalignment(moved),
             other = misalignment(moved, {{"side", "left"}, {"moved", "proximal"}, {"reference", "distal"}});
  for (const Metric& metric : one.as<Metrics>().items)
    EXPECT_NEAR(metric.value, figure(other, metric.name), 1e-9) << metric.name;
}

TEST(Misalignment, TheLimbMayLieOtherwiseInTheCt) {
  // An arm above the head: its end is up, and its front is still the patient's front.
  const RigidTransform moved = motion(turn(8, kBack));
  const auto found = misalignment(moved, {{"side", "left"}, {"up", Numbers{0, 0, -1}}});
  // Now the upper fragment is the distal one. Relative to it the other fragment has turned by 8 degrees about the axis
  // to the back, so it has turned by -8 degrees itself. Seen along the limb, left and right have changed with up and
  // down.
  EXPECT_NEAR(figure(found, "varus_deg"), -8, 0.1);
  EXPECT_EQ(refusal("fracture.misalignment", inputs(poses(moved)), {{"up", Numbers{0, 1, 0}}}),
            "'front' and 'up' must be two different directions of the CT, such as [0, -1, 0] and [0, 0, 1]");
  EXPECT_EQ(
      refusal("fracture.misalignment", inputs(poses(moved)), {{"up", Numbers{0, 1, 0}}, {"front", Numbers{-1, 0, 0}}}),
      "the bone's long axis runs from the patient's left to the right in the CT, so its frontal plane is not "
      "known; give the 'front' and 'up' of this limb in the CT");
}

/// Half of the tubes' facing ends is exactly the fracture's middle, by symmetry.
TEST(Misalignment, TheFractureIsWhereTheSurfacesFaceEachOther) {
  const Vector3d found =
      fracture::middle_of_fracture_mm(*models().find("distal"), "distal", *models().find("proximal"), "proximal");
  EXPECT_LT((found - kFracture_mm).norm(), kNear_mm) << found.transpose();
  Mesh far = *models().find("distal");
  for (Vector3d& vertex : far.vertices_mm) vertex.z() -= 60;
  Inputs given = inputs(poses(motion(turn(8, kBack))));
  given["models"] = per_fragment("proximal", *models().find("proximal"), "distal", far);
  EXPECT_EQ(refusal("fracture.misalignment", given),
            "the surfaces of 'distal' and 'proximal' are nowhere within 20 mm of each other in the CT, so they show no "
            "fracture between them; are they two sides of one fracture?");
}

TEST(Misalignment, ThePlaceOfTheFractureCanBeGiven) {
  Inputs given = inputs(poses(motion(turn(10, kBack))));
  given.erase("models");
  EXPECT_EQ(refusal("fracture.misalignment", given),
            "where the fracture is in the CT is not known, so there is no shift and no shortening; wire the surfaces "
            "of both fragments to 'models', or give the fracture's middle as 'fracture_mm'");
  const Numbers at{kFracture_mm.x(), kFracture_mm.y(), kFracture_mm.z() + 50};
  const auto found = call("fracture.misalignment", given, {{"fracture_mm", at}}).at("metrics");
  EXPECT_NEAR(figure(found, "shift_mm"), 50 * std::sin(10 * kPi / 180), 0.05);
  EXPECT_EQ(refusal("fracture.misalignment", given, {{"fracture_mm", Numbers{1, 2}}}),
            "'fracture_mm' takes one point of the CT, as [x, y, z], got 2 numbers");
}

TEST(Misalignment, AxesOfPosesThatHaveNoneComeFromTheSurface) {
  const auto given = poses(motion(turn(10, kBack), kFracture_mm, {0, 0, 3}));
  const auto right = call("fracture.misalignment", inputs(given)).at("metrics"),
             found = call("fracture.misalignment", inputs(without_axes(given))).at("metrics");
  for (const Metric& metric : right.as<Metrics>().items)
    EXPECT_EQ(metric.value, figure(found, metric.name)) << metric.name;
  Inputs without = inputs(without_axes(given));
  without.erase("models");
  EXPECT_EQ(
      refusal("fracture.misalignment", without, {{"fracture_mm", Numbers{0, 0, 0}}}),
      "the pose of 'distal' does not say where the fragment's middle is and how its long axis runs, as a matrix alone "
      "does not; wire the surfaces of both fragments to 'models', or give the node that reads the pose its model");
}

/// A distal fragment that is shorter than it is wide: the longest way through it is across the bone.
TEST(Misalignment, AShortFragmentDoesNotTellTheLongAxis) {
  Mesh wide = tube(-1, 12);
  for (Vector3d& vertex : wide.vertices_mm) vertex.x() = 3 + 2.5 * (vertex.x() - 3);
  const Matrix3d of_proximal = fragment_frame(*models().find("proximal")).axes;
  const Matrix3d whole = turn(15, of_proximal.col(1)) * turn(40, of_proximal.col(2));
  Inputs given = inputs(without_axes(poses(motion(whole))));
  given["models"] = per_fragment("proximal", *models().find("proximal"), "distal", wide);
  const Heard heard;
  const auto found = call("fracture.misalignment", given, {{"side", "left"}}, heard.context).at("metrics");
  ASSERT_EQ(heard.warnings.size(), 1u);
  const std::string& said = heard.warnings[0];
  EXPECT_NEAR(figure(found, "angulation_deg"), 15, 0.2);
  EXPECT_NEAR(figure(found, "internal_torsion_deg"), -40, 0.2);
  EXPECT_FRAME(said, "the long axes of the two fragments differ by ",
               " degrees in the CT, so one fragment is too short to show the bone's axis; the proximal one is "
               "taken, whose axis is nearer to 'up'");
}

TEST(Misalignment, IsSaidInWords) {
  const auto say = [](const RigidTransform& moved) {
    const Heard heard;
    call("fracture.misalignment", inputs(poses(moved)), {{"side", "right"}}, heard.context);
    return heard.lines.at(heard.lines.size() - 1);
  };
  EXPECT_EQ(say(motion(turn(12, kBack) * turn(30, kUp), kFracture_mm, kAxes * Vector3d(5, 2, -3))),
            "the distal fragment beside the proximal one: 12.0 deg valgus, 30.0 deg internal torsion, 5.0 mm medial "
            "shift, 2.0 mm shift to the back, 3.0 mm lengthening");
  EXPECT_EQ(say(motion(Matrix3d::Identity())), "the distal fragment beside the proximal one: in place");
}

TEST(Misalignment, RefusesOtherFragments) {
  const auto message = [](const List<Pose>& poses, const Options& options) {
    return refusal("fracture.misalignment", inputs(poses), options);
  };
  const std::string distal = "distal", shaft = "shaft";
  const auto given = poses(motion(Matrix3d::Identity()));
  EXPECT_EQ(message(given, {{"moved", distal}, {"reference", shaft}}),
            "there is no pose of a fragment 'shaft', only of proximal, distal; name both fragments with moved and "
            "reference, and register both");
  EXPECT_EQ(message(given, {{"moved", distal}, {"reference", distal}}),
            "moved and reference both name 'distal'; they must be two fragments");
  for (const auto frame : {&RigidTransform::source, &RigidTransform::target}) {
    Pose other = given[1];
    other.world_from_model.*frame = "elsewhere";
    EXPECT_EQ(message(named("proximal", given[0], "distal", other), {}),
              "the poses of 'proximal' and 'distal' are between other frames; both fragments must come from one CT");
  }
}

}  // namespace marrow::test::fracture_test
