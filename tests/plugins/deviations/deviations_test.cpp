// SPDX-License-Identifier: Apache-2.0
// A flat square across the beam: how each error of the image moves it is known by hand.
#include "marrow/toolbox/geometry/camera_deviations.hpp"
#include "plugins/deviations/metal_rims.hpp"
#include "tests/harness/node_test.hpp"

namespace marrow::test::deviations_test {

/// The borders of a square of about 40 mm, a little uneven so that they determine all six axes.
class Square : public OutlineProjector {
 public:
  std::vector<OutlinePoint> outline(const Camera& camera, const RigidTransform& pose, double) const override {
    std::vector<OutlinePoint> points;
    for (int side = 0; side < 4; ++side)
      for (int i = -5; i <= 5; ++i) {
        const double along = 4.0 * i, out = 20 + side;
        const Vector2d normal = side == 0   ? Vector2d(1, 0)
                                : side == 1 ? Vector2d(0, 1)
                                : side == 2 ? Vector2d(-1, 0)
                                            : Vector2d(0, -1);
        const Vector3d at(out * normal.x() - along * normal.y(), out * normal.y() + along * normal.x(),
                          3 * std::sin(7.0 * side + i));
        const Vector3d seen = camera.camera_from_world * (pose * at);
        OutlinePoint point;
        const Vector2d pixel = (camera.intrinsics * seen).hnormalized();
        point.u_px = float(pixel.x()), point.v_px = float(pixel.y());
        point.normal_u = float(normal.x()), point.normal_v = float(normal.y());
        point.model_mm = at.cast<float>();
        points.push_back(point);
      }
    return points;
  }
};

Value views() { return each_view(even_view("only", pinhole(3000, 512, 512), 9)); }

Pose pose() {
  Pose pose;
  pose.world_from_model.translation_mm = {0, 0, 1000};
  pose.covariance = Matrix6d::Zero();
  return pose;
}

/// A list with this pose alone.
List<Pose> stages() { return named("final", pose()); }

Value projector() { return Value::of<OutlineProjector>(std::make_shared<const Square>()); }

struct Errors {
  double offset_px = 0, camera_px = 0, depth_percent = 0, surface_mm = 0, surface_reach_mm = 10, opaque_mm = 0;
};

Pose with_errors(const Errors& errors) {
  const Mesh model = output<Mesh>("simulate.knee_implant", "mesh", {}, {{"part", "tray"}, {"resolution_mm", 2.0}});
  return output<Pose>("deviations.systematic", "pose",
                      {{"stages", shipped::list(stages(), "stage")},
                       {"model", item(model)},
                       {"projector", projector()},
                       {"views", views()}},
                      {{"offset_px", errors.offset_px},
                       {"camera_px", errors.camera_px},
                       {"camera_depth_percent", errors.depth_percent},
                       {"surface_mm", errors.surface_mm},
                       {"surface_reach_mm", errors.surface_reach_mm},
                       {"opaque_mm", errors.opaque_mm}});
}

// 1 pixel at 1000 mm is a third of a millimetre.
TEST(Systematic, AnImageThatIsShiftedShiftsTheBodyAcrossTheBeam) {
  const Matrix6d covariance = *with_errors({.camera_px = 1}).covariance;
  EXPECT_NEAR(std::sqrt(covariance(3, 3)), 1 / 3.0, 0.03);
  EXPECT_NEAR(std::sqrt(covariance(4, 4)), 1 / 3.0, 0.03);
}

// An image that is 1 % larger is that of a body that is 1 % nearer.
TEST(Systematic, AMagnificationIsADepth) {
  EXPECT_NEAR(std::sqrt((*with_errors({.depth_percent = 1}).covariance)(5, 5)), 10, 0.3);
}

TEST(Systematic, NoErrorsAddNothing) { EXPECT_EQ(with_errors({}).covariance->norm(), 0); }

double shift_by_surface(double reach_mm) {
  return std::sqrt((*with_errors({.surface_mm = 1, .surface_reach_mm = reach_mm}).covariance)(3, 3));
}

// Each of the 44 points is off by itself. A turn about the beam moves a point along its normal by its distance from the
// middle of its side: -20 to 20 mm in steps of 4. The squares of all sum up to 7040 mm^2.
TEST(Systematic, ErrorsOfSinglePointsOfTheSurfaceCancel) {
  const double turn = std::sqrt((*with_errors({.surface_mm = 1, .surface_reach_mm = 0.1}).covariance)(2, 2));
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
  const double of_steel = with_errors({.opaque_mm = 1.5}).covariance->norm(),
               of_titanium = with_errors({.opaque_mm = 5}).covariance->norm();
  EXPECT_GT(of_steel, 0);
  EXPECT_GT(of_titanium, of_steel);
}

using geometry::CameraDeviations;

Inputs inputs(const CameraDeviations& stated, const std::string& view = "only") {
  return {{"stages", shipped::list(stages(), "stage")},
          {"projector", projector()},
          {"views", views()},
          {"camera_deviations", per_view(view, stated)}};
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

/// A box of 20 x 30 x 100 mm about (1, 2, 3).
Mesh box() { return test::box({1, 2, 3}, {20, 30, 100}); }

// What the cameras add is known in mm, so the factors that were fitted to residuals do not multiply it.
TEST(DeviationsOfCameras, AreAddedToCalibratedOnesWithoutTheirFactors) {
  Pose pose = deviations_test::pose();
  pose.frame = fragment_frame(box());
  pose.covariance = Matrix6d::Identity();
  const List<Pose> narrow = named("final", pose);
  (*pose.covariance)(3, 3) += 100;
  Inputs all{{"stages", shipped::list(narrow, "stage")},
             {"widened", shipped::list(named("final", pose), "stage")},
             {"model", item(box())}};
  const Options options{{"translation_factors", Numbers{2, 2, 2}}};
  const Pose found = output<Pose>("deviations.calibrated", "pose", all, options);
  EXPECT_NEAR((*found.covariance)(3, 3), 4 + 100, 1e-9);
  EXPECT_NEAR((*found.covariance)(4, 4), 4, 1e-9);
  all["widened"] = shipped::list(named("first", pose), "stage");
  EXPECT_EQ(refusal("deviations.calibrated", all, options),
            "widened and stages are not the same poses; wire the stages of the node that got these stages");
}

/// A pose whose own axes are not those of the box, with deviations of 1 about and along each axis of the box.
Pose turned_pose() {
  Pose pose;
  pose.frame = fragment_frame(box());
  pose.covariance = Matrix6d::Identity();
  FragmentFrame other = pose.frame;
  other.origin_mm += Vector3d(5, -7, 11);
  other.axes = (other.axes * rotation_from_vector({0.3, -0.2, 0.5})).eval();
  return in_frame(pose, other);
}

Outputs calibrated(const List<Pose>& stages, const Options& options) {
  return call("deviations.calibrated", {{"stages", shipped::list(stages, "stage")}, {"model", item(box())}}, options);
}

/// Standard deviations about and along the box's axes.
Vector6d deviations(const Pose& pose) {
  return in_frame(pose, fragment_frame(box())).covariance->diagonal().cwiseSqrt();
}

TEST(DeviationsCalibrated, MultipliesTheDeviationsAboutAndAlongTheBonesAxes) {
  List<Pose> stages;
  stages.add("start", Pose());
  stages.add("first", turned_pose());
  stages.add("final", turned_pose());
  const auto outputs = calibrated(stages, {{"rotation_factors", Numbers{2, 3, 0.5}},
                                           {"translation_factors", Numbers{0.25, 1, 7}},
                                           {"first_rotation_factors", Numbers{1, 1, 9}},
                                           {"first_translation_factors", Numbers{1, 0.1, 1}}});
  const auto found = outputs.at("stages").as_list<Pose>();
  ASSERT_EQ(found.names(), stages.names());
  EXPECT_FALSE(found[0].covariance);
  EXPECT_LT((deviations(found[1]) - Vector6d{1, 1, 9, 1, 0.1, 1}).norm(), 1e-9);
  EXPECT_LT((deviations(found[2]) - Vector6d{2, 3, 0.5, 0.25, 1, 7}).norm(), 1e-9);
  const auto last = outputs.at("pose").as<Pose>();
  EXPECT_EQ(*last.covariance, *found[2].covariance);
  EXPECT_EQ(last.frame.origin_mm, turned_pose().frame.origin_mm) << "the covariance is in the frame that it was in";
}

TEST(DeviationsCalibrated, WhereTheFirstStageIsTheLastTheFactorsAreThoseOfTheLast) {
  const auto outputs = calibrated(named("first", turned_pose()), {{"rotation_factors", Numbers{2, 2, 2}}});
  EXPECT_LT((deviations(outputs.at("pose").as<Pose>()) - Vector6d{2, 2, 2, 1, 1, 1}).norm(), 1e-9);
}

TEST(DeviationsCalibrated, ADirectionThatIsNotKnownStaysUnknown) {
  Pose unknown = turned_pose();
  (*unknown.covariance)(2, 2) = std::numeric_limits<double>::infinity();
  const auto outputs = calibrated(named("final", unknown), {{"rotation_factors", Numbers{2, 2, 2}}});
  EXPECT_EQ(*outputs.at("pose").as<Pose>().covariance, *unknown.covariance);
}

TEST(DeviationsCalibrated, WithoutAPoseItSaysSo) {
  EXPECT_EQ(
      refusal("deviations.calibrated", {{"stages", shipped::list(List<Pose>(), "stage")}, {"model", item(box())}}),
      "there is no pose; wire the stages of a registration");
}

/// 3 pixels a mm at the body, which is 1 m away.
const Camera kCamera = pinhole(3000, 512, 512, {{256, 256}});
const RigidTransform kPlaced = placed({0, 0, 1000});

/// A prism along y. Its section is a triangle whose sharp edge points to -x: the path along z grows by 1 mm a mm.
Mesh wedge() {
  Mesh mesh;
  for (const double y : {-40.0, 40.0})
    for (const Vector2d& at : {Vector2d(-20, 0), Vector2d(20, 20), Vector2d(20, -20)})
      mesh.vertices_mm.emplace_back(at.x(), y, at.y());
  mesh.triangles = {{0, 2, 1}, {3, 4, 5}, {0, 1, 4}, {0, 4, 3}, {1, 2, 5}, {1, 5, 4}, {2, 0, 3}, {2, 3, 5}};
  return mesh;
}

TEST(PathLengths, OfABoxAcrossTheBeam) {
  const deviations::PathLengths paths(test::box({0, 0, 0}, {40, 30, 20}), kCamera, kPlaced);
  EXPECT_NEAR(paths.at(256, 256), 20, 1e-3);
  EXPECT_NEAR(paths.at(256 + 30, 256), 20 * std::hypot(1, 0.01), 1e-3) << "the ray is slanted";
  EXPECT_EQ(paths.at(256 + 70, 256), 0);
  EXPECT_EQ(paths.at(-5, 700), 0);
}

/// The edge of the wedge is at x = -20 mm, pixel 196.
double inside_px(const Mesh& mesh, double edge_px, const deviations::Rim& rim) {
  OutlinePoint point;
  point.u_px = float(edge_px), point.v_px = 256, point.normal_u = -1;
  return edge_inside_px(deviations::PathLengths(mesh, kCamera, kPlaced), point, rim);
}

// Along a wedge, the radiation falls as exp(-d / t). Its slope, blurred by a Gaussian, is the density of a normal and
// an exponential variable together, whose mode is from scipy.stats.exponnorm.
TEST(EdgeInside, OfAWedgeIsTheModeOfItsBlurredSlope) {
  ASSERT_TRUE(is_closed(wedge()));
  EXPECT_NEAR(inside_px(wedge(), 196, {1 / 3.0, 2}), 0.856, 0.25);
  EXPECT_NEAR(inside_px(wedge(), 196, {2, 2}), 2.431, 0.25);
}

TEST(EdgeInside, OfABoxIsItsBorder) {
  EXPECT_NEAR(inside_px(test::box({0, 0, 0}, {40, 30, 20}), 256 - 3000 * 20 / 990.0, {1, 2}), 0, 0.25);
}

}  // namespace marrow::test::deviations_test
