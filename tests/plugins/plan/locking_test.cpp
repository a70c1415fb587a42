// SPDX-License-Identifier: Apache-2.0
#include <marrow/domain/random.hpp>

#include "tests/plugins/plan/implants.hpp"

namespace marrow::test::locking_test {

using geometry::Implant, geometry::LockingPlan;
using implants::inputs, implants::pose, implants::rod;

LockingPlan::Drill drill_of(const Pose& at, const Options& options = {}) {
  return implants::locking(rod(), at, options).at("plan").as<LockingPlan>().drills.at(0);
}

TEST(PlanLocking, AxisAndGuideFollowThePose) {
  // A quarter turn about z brings the hole's axis from x to y. The drill comes from +y.
  const Pose at = pose({0, 0, kPi / 2}, {0, 0, 50}, {3, -4, 12});
  const auto drill = drill_of(at, {{"from", Numbers{0, 1, 0}}, {"guide_mm", 80.0}});
  EXPECT_EQ(drill.hole, "distal");
  EXPECT_TRUE(drill.centre_mm.isApprox(Vector3d(3, -4, 12), 1e-12));
  EXPECT_TRUE(drill.direction.isApprox(Vector3d(0, -1, 0), 1e-12));
  EXPECT_TRUE(drill.guide_mm.isApprox(Vector3d(3, 76, 12), 1e-12));
  EXPECT_TRUE(drill.doubts.empty());
}

/// Where the planned view shows a rim of the hole, which lies `along_mm` along the axis from the hole's centre.
std::vector<Vector2d> rim(const LockingPlan::Drill& drill, double along_mm) {
  const Camera camera = implants::camera(drill.alpha_deg, drill.beta_deg);
  const Vector3d side = drill.direction.unitOrthogonal(), other = drill.direction.cross(side);
  std::vector<Vector2d> pixels;
  for (int k = 0; k < 36; ++k) {
    const double angle = radians(10 * k);
    pixels.push_back(project(camera, drill.centre_mm + along_mm * drill.direction +
                                         0.5 * drill.diameter_mm * (std::cos(angle) * side + std::sin(angle) * other)));
  }
  return pixels;
}

Vector2d middle_of(const std::vector<Vector2d>& pixels) {
  Vector2d sum(0, 0);
  for (const Vector2d& pixel : pixels) sum += pixel / double(pixels.size());
  return sum;
}

/// The longest radius divided by the shortest.
double ratio_of(const std::vector<Vector2d>& pixels) {
  double least = 1e9, most = 0;
  for (const Vector2d& pixel : pixels) {
    least = std::min(least, (pixel - middle_of(pixels)).norm());
    most = std::max(most, (pixel - middle_of(pixels)).norm());
  }
  return most / least;
}

TEST(PlanLocking, TheHoleIsACircleInThePlannedView) {
  // At the isocentre, both rims are exact circles around one middle.
  const auto drill = drill_of(pose({0.2, -0.3, 0.5}, {0, 0, 50}, {0, 0, 0}));
  for (const double along_mm : {-5.0, 5.0}) {
    EXPECT_NEAR(ratio_of(rim(drill, along_mm)), 1, 1e-9);
    EXPECT_NEAR((middle_of(rim(drill, along_mm)) - Vector2d(255.5, 255.5)).norm(), 0, 1e-6);
  }
  // Elsewhere the detector is a little oblique to the ray: 1 / cos(7 degrees).
  const auto off = drill_of(pose({0.2, -0.3, 0.5}, {0, 0, 50}, {20, -15, -65}));
  EXPECT_LT(ratio_of(rim(off, 5)), 1.01);
  const Camera camera = implants::camera(off.alpha_deg, off.beta_deg);
  const Vector2d front = project(camera, off.centre_mm - 5 * off.direction),
                 back = project(camera, off.centre_mm + 5 * off.direction);
  EXPECT_NEAR((front - back).norm(), 0, 1e-6) << "the axis is seen as a point";
}

TEST(PlanLocking, TheCArmTurnsAsLittleAsItCan) {
  // The hole lies from side to side, so the view is lateral, from one of the two sides.
  const auto drill = drill_of(pose({0, 0, 0.1}, {0, 0, 50}, {0, 0, 0}));
  EXPECT_NEAR(drill.alpha_deg, 0, 1e-9);
  EXPECT_NEAR(std::abs(drill.beta_deg), 90 - degrees(0.1), 1e-9);
}

TEST(PlanLocking, DeviationsComeFromThePosesCovariance) {
  const auto predicted = [](const Vector6d& deviations) {
    Pose at = pose({0, 0, 0}, {0, 0, 50}, {0, 0, 0});
    at.covariance = Matrix6d(deviations.cwiseAbs2().asDiagonal());
    const auto drill = drill_of(at);
    return Vector2d(drill.deviation_deg, drill.deviation_mm);
  };
  const double turn = radians(0.2);
  // About the hole's own axis: the hole, 50 mm from the origin, moves across. About the rod: the axis turns.
  EXPECT_TRUE(predicted({turn, 0, 0, 0, 0, 0}).isApprox(Vector2d(0, 50 * turn), 1e-9));
  EXPECT_TRUE(predicted({0, turn, 0, 0, 0, 0}).isApprox(Vector2d(0.2, 0), 1e-9)) << "the hole moves along its axis";
  EXPECT_TRUE(predicted({0, 0, turn, 0, 0, 0}).isApprox(Vector2d(0.2, 0), 1e-9));
  EXPECT_TRUE(predicted({0, 0, 0, 0.9, 0.3, 0.4}).isApprox(Vector2d(0, 0.5), 1e-9)) << "along the axis does not count";
}

TEST(PlanLocking, TheDrillComesFromTheOuterSideOfTheLeg) {
  const Pose at = pose({0, 0, 0}, {0, 0, 50}, {0, 0, 0});
  EXPECT_TRUE(drill_of(at, {{"side", "left"}}).guide_mm.isApprox(Vector3d(100, 0, 0), 1e-9)) << "the patient's left";
  EXPECT_TRUE(drill_of(at, {{"side", "right"}}).guide_mm.isApprox(Vector3d(-100, 0, 0), 1e-9)) << "his right";
  const auto from_front = drill_of(pose({0, 0, kPi / 2}, {0, 0, 50}, {0, 0, 0}), {{"side", "right"}});
  EXPECT_TRUE(from_front.guide_mm.isApprox(Vector3d(0, -100, 0), 1e-9)) << "a hole from front to back";
}

/// The quantiles are those of scipy: the distribution of x^2 + y^2 by quadrature (scipy.integrate.quad over x of the
/// density times 2 norm.cdf(sqrt(r^2 - x^2) / deviation of y) - 1), solved for 0.95 by brentq.
TEST(PlanLocking, NinetyFivePerCentAreThatForAnyShapeOfTheCovariance) {
  struct Case {
    double ratio, quantile;  // of the two deviations; in deviations of the larger one
  };
  for (const Case& one : {Case{0, 1.959963985}, Case{0.2, 1.970407501}, Case{0.5, 2.035858720}, Case{1, 2.447746831}}) {
    Pose at = pose({0, 0, 0}, {0, 0, 50}, {0, 0, 0});
    const double turn = radians(0.4);
    Vector6d deviations;
    deviations << 0, turn * one.ratio, turn, 0, 0, 0;
    at.covariance = Matrix6d(deviations.cwiseAbs2().asDiagonal());
    EXPECT_NEAR(drill_of(at).most_deg, 0.4 * one.quantile, 1e-8) << one.ratio;
    deviations << 0, 0, 0, 0, 0.3 * one.ratio, 0.3;
    at.covariance = Matrix6d(deviations.cwiseAbs2().asDiagonal());
    EXPECT_NEAR(drill_of(at).most_mm, 0.3 * one.quantile, 1e-8) << one.ratio;
  }
}

/// 4000 poses drawn from a covariance whose largest part is a turn about the nail: 95 % of the holes' axes turn by at
/// most the stated angle. (Three deviations of the share are 1.0 %.)
TEST(PlanLocking, NinetyFivePerCentOfDrawnPosesAreWithin) {
  Pose at = pose({0.1, 0.2, 0.3}, {0, 0, 50}, {0, 0, 0});
  Vector6d deviations;
  deviations << radians(0.05), radians(0.08), radians(0.6), 0.1, 0.3, 0.2;
  at.covariance = Matrix6d(deviations.cwiseAbs2().asDiagonal());
  const auto drill = drill_of(at);
  Random random(7);
  constexpr int kDraws = 4000;
  int within_deg = 0, within_mm = 0;
  for (int i = 0; i < kDraws; ++i) {
    Vector6d motion;
    for (int k = 0; k < 6; ++k) motion[k] = deviations[k] * random.normal();
    const RigidTransform true_pose = moved(at.world_from_model, at.frame, motion);
    const Vector3d axis = true_pose.rotation * Vector3d::UnitX(), off = true_pose * Vector3d(0, 0, 50);
    within_deg += degrees(std::asin(axis.cross(drill.direction).norm())) < drill.most_deg;
    within_mm += (off - drill.centre_mm).cross(drill.direction).norm() < drill.most_mm;
  }
  EXPECT_NEAR(within_deg / double(kDraws), 0.95, 0.0104);
  EXPECT_NEAR(within_mm / double(kDraws), 0.95, 0.0104);
}

Verdict verdict_of(const Pose& at, const Options& options = {}) {
  return implants::locking(rod(), at, options).at("verdict").as<Verdict>();
}

/// A cost that is the same everywhere.
class Constant : public Cost {
 public:
  explicit Constant(double value) : value_(value) {}
  double value(const RigidTransform&) const override { return value_; }
  std::shared_ptr<const Cost> at_level(const CostLevel&) const override { return std::make_shared<Constant>(value_); }

 private:
  double value_;
};

TEST(PlanLocking, DoubtsAreSaidInWords) {
  Pose at = pose({0, 0, 0}, {0, 0, 50}, {0, 0, 0});
  EXPECT_EQ(verdict_of(at).judgement, Judgement::trusted);
  EXPECT_HAS(verdict_of(at).reasons.at(0), "the axes of the holes are known to 0.01 degrees and ");
  const auto is_doubted = [&](const std::string& reason, const Options& options = {}) {
    const Verdict verdict = verdict_of(at, options);
    EXPECT_EQ(verdict.judgement, Judgement::doubtful);
    EXPECT_FALSE(verdict.remedies.empty());
    EXPECT_EQ(verdict.reasons.at(0), reason);
  };
  // One direction of a turn or shift: 1.96 deviations.
  at.covariance->diagonal() << 0, 0, std::pow(radians(0.57), 2), 0, 0, 0;
  is_doubted("distal: the direction of the hole is known to 1.12 degrees only (95 %), and the limit is 1.00");
  at.covariance->diagonal() << 0, 0, 0, 0, 0.27 * 0.27, 0;
  is_doubted("distal: the place of the hole is known to 0.53 mm only (95 %), and the limit is 0.50");
  at.covariance.reset();
  is_doubted("distal: the pose of the nail has no predicted deviations, so nothing says how far the hole is off");
  at = pose({0, 0, 0}, {0, 0, 50}, {0, 0, 0});
  at.warnings = {"axial rotation is poorly determined"};
  is_doubted("the registration warns: axial rotation is poorly determined");
  at = pose({0, 0, 0}, {0, 0, 50}, {0, 110, 0});  // out of the lateral view
  is_doubted("distal: only one view shows the hole");
  at = pose({0, 0, 0}, {0, 0, 50}, {0, 0, 0});
  Inputs with_cost = inputs(rod(), at);
  with_cost["cost"] = Value::of<Cost>(std::make_shared<const Constant>(0.6));
  const Verdict verdict = output<Verdict>("plan.locking", "verdict", with_cost, {{"side", "left"}});
  EXPECT_EQ(verdict.reasons.at(0),
            "the images do not show the holes where this pose has them: the cost there is 0.60, and the limit is 0.35");
  EXPECT_EQ(output<Verdict>("plan.locking", "verdict", with_cost, {{"side", "left"}, {"max_cost", 0.7}}).judgement,
            Judgement::trusted);
}

TEST(PlanLocking, RefusesWhatCannotBePlanned) {
  const Pose at = pose({0, 0, 0}, {0, 0, 50}, {0, 0, 0});
  const auto refusal = [](const Implant& implant, const Pose& pose, const Options& options = {}) {
    return shipped::refusal("plan.locking", inputs(implant, pose), implants::of_left_leg(options));
  };
  const auto changed = [&](const std::function<void(Implant&)>& change) {
    Implant implant = rod();
    change(implant);
    return refusal(implant, at);
  };
  EXPECT_EQ(changed([](Implant& rod) { rod.holes.clear(); }),
            "plan.locking: the implant has no holes, so there is nothing to lock; give each hole's centre and axis");
  EXPECT_EQ(changed([](Implant& rod) { rod.holes[0].axis.setZero(); }),
            "plan.locking: the axis of hole 'distal' has the length 0.000000, so it has no direction; give the "
            "direction of the hole, such as [1, 0, 0]");
  EXPECT_EQ(changed([](Implant& rod) { rod.holes[0].axis *= 0.5; }),
            "plan.locking: the axis of hole 'distal' must have length 1, got 0.500000");
  EXPECT_EQ(changed([](Implant& rod) { rod.holes.push_back(rod.holes[0]); }),
            "plan.locking: two holes are named 'distal'; rename one");
  EXPECT_EQ(changed([](Implant& rod) { rod.holes[0].diameter_mm = 0; }),
            "plan.locking: the diameter of hole 'distal' must be above 0 mm, got 0.000000");
  EXPECT_EQ(changed([](Implant& rod) { rod.holes[0].centre_mm.x() = std::nan(""); }),
            "plan.locking: the centre of hole 'distal' is not finite");
  EXPECT_EQ(changed([](Implant& rod) { rod.surface.triangles.pop_back(); }),
            "plan.locking: the surface is open or not consistently oriented, so it has no inside; close its holes "
            "(each edge must be shared by exactly two triangles)");
  EXPECT_HAS(changed([](Implant& rod) {
               for (auto& triangle : rod.surface.triangles) std::swap(triangle[0], triangle[1]);
             }),
             "plan.locking: the triangles face inward (enclosed volume -");
  EXPECT_EQ(refusal(rod(), pose({0, 0, 0}, {0, 0, 50}, {0, 0, 300})),
            "plan.locking: no view shows any of the 1 holes of the nail at its pose; take images of the nail's tip, or "
            "check the pose");
  EXPECT_EQ(refusal(rod(), at, {{"from", Numbers{0, 0, 0}}}),
            "plan.locking: from has the length 0; give the direction from which the drill comes, such as [1, 0, 0]");
  EXPECT_EQ(refusal(rod(), at, {{"from", Numbers{1, 0}}}),
            "plan.locking: from takes one direction, as [1, 0, 0], got 2 numbers");
  EXPECT_EQ(shipped::refusal("plan.locking", inputs(rod(), at)),
            "plan.locking: nothing says from which side the drill comes; give 'side' (left or right: of the leg), or "
            "'from', such as [1, 0, 0] for the patient's left");
  EXPECT_EQ(refusal(rod(), at, {{"isocentre_mm", Numbers{0, 0, 700}}}),
            "plan.locking: hole 'distal' lies 700.00 mm from the isocentre, but the C-arm's source is only 600.00 mm "
            "from it; check isocentre_mm and the pose");
}

TEST(PlanBodies, BonesNailAndARodForEachHole) {
  const Pose at = pose({0, 0, 0}, {0, 0, 50}, {0, 0, 0});
  const auto plan = implants::locking(rod(), at).at("plan");
  const List<Pose> poses = named("femur", at);
  const auto bodies =
      call("plan.bodies", {{"models", per_fragment("femur", rod().surface, "without a pose", rod().surface)},
                           {"poses", shipped::list(poses, "fragment")},
                           {"nail", item(rod().surface)},
                           {"pose", item(at)},
                           {"plan", plan}});
  const auto meshes = bodies.at("models").as_list<Mesh>();
  EXPECT_EQ(meshes.names(), (Strings{"femur", "nail", "distal"}));
  EXPECT_EQ(bodies.at("poses").as_list<Pose>().names(), meshes.names());
  double most_x = -1e9, least_x = 1e9;
  for (const Vector3d& vertex : meshes[2].vertices_mm) {
    most_x = std::max(most_x, vertex.x());
    least_x = std::min(least_x, vertex.x());
    EXPECT_LT(vertex.tail<2>().norm(), 2.5) << "within the hole";
  }
  EXPECT_NEAR(most_x, 100, 1e-9);  // the drill guide, on the side of `from`
  EXPECT_NEAR(least_x, -30, 1e-9);
}

}  // namespace marrow::test::locking_test
