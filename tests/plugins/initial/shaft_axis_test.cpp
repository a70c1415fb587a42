// SPDX-License-Identifier: Apache-2.0
#include "marrow/initial/axis.hpp"
#include "tests/plugins/edges/radiograph.hpp"
#include "tests/plugins/initial/tube.hpp"

namespace marrow::test::shaft_axis_test {

using tube::posed;

/// Views with the borders of a shaft.
struct Scene {
  List<View> views;
  List<ShaftLines> lines;
  void add(double angle_deg, const std::function<ShaftLines(const Camera&)>& borders) {
    const View view = view_of("at " + std::to_string(int(angle_deg)), radiograph::camera(angle_deg));
    views.add(view.name, view);
    lines.add(view.name, borders(view.camera));
  }
  Inputs inputs(const Mesh& model, const RigidTransform* start = nullptr) const {
    Inputs inputs{{"model", item(model)}, {"lines", list(lines, "view")}, {"views", each_view(views)}};
    if (start) inputs["start"] = item(pose_of(*start));
    return inputs;
  }
  Pose shaft_axis(const Mesh& model, const RigidTransform* start = nullptr, const Options& options = {}) const {
    return output<Pose>("initial.shaft_axis", "pose", inputs(model, start), options);
  }
};

/// Views from the angles, with the borders that the model at its true pose shows between two heights of the image.
Scene true_views(const Mesh& model, const RigidTransform& truth, const Numbers& angles_deg) {
  Scene scene;
  for (const double angle_deg : angles_deg)
    scene.add(angle_deg, [&](const Camera& camera) {
      ShaftLines window;
      window.left = {{300, 60}, {300, 350}};
      window.right = {{200, 60}, {200, 350}};
      const auto borders = *initial::model_borders(model, truth, camera, window, 3);
      ShaftLines seen;
      seen.left = borders.left, seen.right = borders.right;
      return seen;
    });
  return scene;
}

/// Errors of the axis at the fragment's origin: angle between long axes, and distance across the axis.
std::pair<double, double> axis_errors(const Pose& pose, const RigidTransform& truth) {
  const Vector3d z = truth.rotation * pose.frame.axes.col(2),
                 found = pose.world_from_model.rotation * pose.frame.axes.col(2);
  const Vector3d off = pose.world_from_model * pose.frame.origin_mm - truth * pose.frame.origin_mm;
  return {degrees(std::atan2(z.cross(found).norm(), z.dot(found))), (off - z * z.dot(off)).norm()};
}

void expect_axis(const Pose& pose, const RigidTransform& truth, double most_deg, double most_mm) {
  const auto [turned_deg, off_mm] = axis_errors(pose, truth);
  EXPECT_LT(turned_deg, most_deg);
  EXPECT_LT(off_mm, most_mm);
}

const RigidTransform kTruth = posed({4, -6, 0}, {8, -5, 3});

TEST(ShaftAxis, FindsTheAxisOfACylinderFromTwoAndThreeViews) {
  const Mesh model = tube::cylinder(14, 90);
  for (const Numbers& angles_deg : {Numbers{0, 90}, {0, 60, 120}}) {
    Scene scene;
    for (const double angle_deg : angles_deg)
      scene.add(angle_deg, [](const Camera& camera) {
        return tube::borders(camera, kTruth.translation_mm, kTruth.rotation.col(2), 14, 60, 350);
      });
    const Pose pose = scene.shaft_axis(model);
    expect_axis(pose, kTruth, 0.02, 0.02);
    EXPECT_TRUE(pose.warnings.empty());
    EXPECT_EQ(pose.world_from_model.source, "ct");
    EXPECT_EQ(pose.frame.origin_mm, fragment_frame(model).origin_mm);
  }
}

// A bow of 900 mm radius to the front, a taper of 2 degrees on each side and a ridge of 4 mm at the back: none of them
// moves the axis, because the model is measured in the same way as the image.
TEST(ShaftAxis, IsNotMisledByBowTaperAndRidge) {
  const Mesh model = tube::mesh(
      90,
      [](double z, double angle) {
        return 14 - 0.035 * z + 4 * std::exp(-std::pow(std::remainder(angle - kPi / 2, 2 * kPi) / 0.3, 2));
      },
      [](double z) { return Vector3d(0, z * z / 1800, 0); });
  for (const Vector3d& tilt : {Vector3d(5, -4, 0), Vector3d(-8, 3, 0)}) {
    const RigidTransform truth = posed(tilt, {6, -9, 0});
    expect_axis(true_views(model, truth, {0, 90}).shaft_axis(model), truth, 0.3, 0.5);
  }
}

TEST(ShaftAxis, KeepsRotationAboutAndPlaceAlongTheAxisFromTheStart) {
  const Mesh model = tube::cylinder(14, 90);
  const RigidTransform start = posed({0, 0, 25}, {0, 0, 7});
  const Pose pose = true_views(model, kTruth, {0, 90}).shaft_axis(model, &start);
  const Matrix3d turn = pose.world_from_model.rotation * start.rotation.transpose();
  EXPECT_NEAR(vector_from_rotation(turn).dot(Vector3d::UnitZ()), 0, 1e-3);
  EXPECT_NEAR(kTruth.rotation.col(2).dot(pose.world_from_model.translation_mm - Vector3d(0, 0, 7)), 0, 0.15);
}

const Options kExact{{"border_inset_mm", 0.0}};  // for borders that are those of the silhouette itself

TEST(ShaftAxis, TakesTheDepthOfASingleViewFromTheWidth) {
  const Mesh model = tube::cylinder(14, 90);
  const RigidTransform truth = posed({0, 5, 0}, {9, 30, 0});  // 30 mm farther from the source than the start
  const Pose pose = true_views(model, truth, {0}).shaft_axis(model, nullptr, kExact);
  const Vector3d off = pose.world_from_model * pose.frame.origin_mm - truth * pose.frame.origin_mm;
  EXPECT_LT(axis_errors(pose, truth).first, 0.3);
  EXPECT_LT(std::abs(off.y()), 1.0);
  EXPECT_LT(std::abs(off.x()), 0.3);
}

TEST(ShaftAxis, LeavesAPerfectStartWhereItIs) {
  const Mesh model = tube::cylinder(14, 90);
  const RigidTransform start = posed({6, 5, 40}, {9, -12, 0});
  for (const Numbers& angles_deg : {Numbers{0}, {0, 90}, {0, 60, 120}})
    expect_axis(true_views(model, start, angles_deg).shaft_axis(model, &start, kExact), start, 0.02, 0.02);
}

TEST(ShaftAxis, WarnsOfBordersThatAreNotThoseOfTheModel) {
  const Mesh model = tube::cylinder(14, 90);
  Scene scene = true_views(model, posed({0, 0, 0}, {0, 0, 0}), {0});
  scene.add(90, [](const Camera& camera) { return tube::borders(camera, {0, 0, 0}, {0, 0, 1}, 19, 60, 350); });
  EXPECT_EQ(scene.shaft_axis(model).warnings, Strings{"view 'at 90': the shaft's borders are 39.0 mm apart, where the "
                                                      "model is 28.0 mm wide; they may belong to something else"});
}

// As in an image of a fracture: the shaft that was found belongs to the other fragment, below this one. This fragment's
// own pair was rejected, and comes after a canal and a pair that is too short.
TEST(ShaftAxis, TakesTheLinesWhereTheFragmentIs) {
  const RigidTransform truth = posed({4, -6, 0}, {8, -5, 50}), start = posed({0, 0, 0}, {0, 0, 50});
  Scene scene;
  for (const double angle_deg : {0.0, 90.0})
    scene.add(angle_deg, [&](const Camera& camera) {
      const auto pair = [&](double radius_mm, double from_v, double to_v) {
        return tube::borders(camera, truth.translation_mm, truth.rotation.col(2), radius_mm, from_v, to_v);
      };
      const double middle_v = project(camera, truth.translation_mm).y();
      ShaftLines found = tube::borders(camera, {0, 0, -60}, {0, 0, 1}, 14, middle_v + 200, middle_v + 350);
      for (const ShaftLines& other : {pair(6, middle_v - 80, middle_v + 80), pair(14.5, middle_v - 10, middle_v + 10),
                                      pair(14, middle_v - 80, middle_v + 80)})
        found.rejected.push_back({other.left, other.right, "outdone"});
      return found;
    });
  expect_axis(scene.shaft_axis(tube::cylinder(14, 45), &start), truth, 0.02, 0.02);
}

TEST(ShaftAxis, SaysWhatIsMissing) {
  const Mesh model = tube::cylinder(14, 90);
  const Inputs good = true_views(model, posed({0, 0, 0}, {0, 0, 0}), {0, 90}).inputs(model);
  const auto refusal = [&](const Inputs& others) { return shipped::refusal("initial.shaft_axis", with(good, others)); };
  EXPECT_EQ(refusal({{"views", each_view(good.at("views").as_list<View>()[0])}}),
            "there are shaft lines of a view 'at 90', but no view of that name");
  EXPECT_EQ(refusal({{"start", item(pose_at({0, -700, 0}))}}),
            "view 'at 0': the model does not lie in front of the X-ray source; give a start nearer to the bone");
  EXPECT_EQ(refusal({{"lines", list(List<ShaftLines>(), "view")}}),
            "there are no shaft lines; wire the lines of at least one view");
  EXPECT_EQ(refusal({{"start", item(pose_at({0, 0, 400}))}}),
            "view 'at 0': the model at its start is not where the image shows the shaft, and no other pair of lines "
            "fits it; give a start nearer to the bone");
  EXPECT_EQ(refusal({{"lines", per_view("at 0", ShaftLines())}}), "view 'at 0': a border of the shaft has no length");
  EXPECT_EQ(refusal({{"model", item(Mesh())}}), "model: the surface has no triangles");
}

}  // namespace marrow::test::shaft_axis_test

namespace marrow::test::axis_test {

using namespace initial;

struct Case {
  Vector3d point, direction;
};
Case random_axis(std::mt19937& random, double off_mm, double tilt_deg) {
  std::uniform_real_distribution<double> unit(-1, 1);
  const double a = radians(tilt_deg);
  return {{off_mm * unit(random), off_mm * unit(random), 0},
          Vector3d(std::tan(a * unit(random)), std::tan(a * unit(random)), 1).normalized()};
}
double angle_deg(const Vector3d& a, const Vector3d& b) {
  return degrees(std::atan2(a.cross(b).norm(), std::abs(a.dot(b))));
}

TEST(Axis, OfACylinderIsExactFromItsBordersInTwoAndThreeViews) {
  std::mt19937 random(3);
  for (const Numbers& angles : {Numbers{0, 90}, {0, 60, 120}})
    for (int i = 0; i < 2000; ++i) {
      const Case truth = random_axis(random, 40, 15);
      std::vector<Plane> planes;
      for (double angle : angles) {
        const Camera camera = radiograph::camera(angle);
        const auto lines = tube::borders(camera, truth.point, truth.direction, 14, 50, 400);
        planes.push_back(bisecting_plane(camera, lines.left, lines.right));
      }
      const Axis axis = axis_of_planes(planes);
      ASSERT_LT(angle_deg(axis.direction, truth.direction), 1e-6);
      ASSERT_LT((axis.nearest_to(truth.point) - truth.point).norm(), 1e-6);
      ASSERT_LT(std::abs(axis.point_mm.dot(axis.direction)), 1e-6);  // Eq 7: the point nearest to the origin
    }
}

// The chapter's planes stand at right angles to the image, through the mid line drawn in the plane of the detector (or
// scaled down by source-to-isocentre over source-to-detector). This is what that costs, and why it is not done.
TEST(Axis, ByOrthogonalPlanesErrsByDegreesAndMillimetres) {
  struct Row {
    double off_mm, tilt_deg, turned_deg, off_by_mm, demagnified_mm;
  };
  for (const Row& row : {Row{20, 5, 0.07, 10.3, 0.24}, Row{40, 5, 0.14, 20.3, 0.94}, Row{40, 15, 0.39, 20.5, 0.97}}) {
    std::mt19937 random(4);
    double turned_deg = 0, off_by_mm = 0, demagnified_mm = 0;
    for (int i = 0; i < 2000; ++i) {
      const Case truth = random_axis(random, row.off_mm, row.tilt_deg);
      const auto axis_by = [&](double scale) {
        std::vector<Plane> planes;
        for (double angle : {0.0, 90.0}) {
          const Camera camera = radiograph::camera(angle);
          const auto in_plane =
              [&](double s) -> Vector3d {  // image point in mm about the principal point, in world axes
            const Vector2d pixel = project(camera, truth.point + s * truth.direction);
            const Vector2d mm = (pixel - camera.intrinsics.topRightCorner<2, 1>()) * (300.0 / 512) * scale;
            return camera.camera_from_world.rotation.transpose() * Vector3d(mm.x(), mm.y(), 0);
          };
          const Vector3d a = in_plane(-50), b = in_plane(50);
          Plane plane;
          plane.normal = (b - a).cross(camera.camera_from_world.rotation.transpose().col(2)).normalized();
          plane.offset_mm = plane.normal.dot(a);
          planes.push_back(plane);
        }
        return axis_of_planes(planes);
      };
      const Axis plain = axis_by(1), scaled = axis_by(0.6);
      turned_deg = std::max(turned_deg, angle_deg(plain.direction, truth.direction));
      off_by_mm = std::max(off_by_mm, (plain.nearest_to(truth.point) - truth.point).norm());
      demagnified_mm = std::max(demagnified_mm, (scaled.nearest_to(truth.point) - truth.point).norm());
    }
    EXPECT_GT(turned_deg, 0.5 * row.turned_deg);
    EXPECT_GT(off_by_mm, 0.5 * row.off_by_mm);
    EXPECT_GT(demagnified_mm, 0.4 * row.demagnified_mm);
  }
}

TEST(Axis, MoveMapsModelOriginAndZOntoTheTargets) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> unit(-1, 1);
  for (int i = 0; i < 100; ++i) {
    Axis model{{20 * unit(random), 20 * unit(random), 9},
               Vector3d(0.3 * unit(random), 0.3 * unit(random), 1).normalized()};
    Axis target{{20 * unit(random), 20 * unit(random), 3},
                Vector3d(0.3 * unit(random), 0.3 * unit(random), 1).normalized()};
    if (i % 2) target.direction = -target.direction;  // an axis has no sense of its own
    const Vector3d anchor(5, -7, 60);
    const RigidTransform move = world_from_world_move(model, target, anchor);
    check_rigid(move, "move");
    const Vector3d origin = model.nearest_to(anchor), moved = move * origin;
    EXPECT_LT((moved - target.nearest_to(origin)).norm(), 1e-9);
    const Vector3d z = move.rotation * model.direction;
    EXPECT_NEAR(std::abs(z.dot(target.direction)), 1, 1e-12);
    EXPECT_GT(z.dot(model.direction), 0);
    // No turn about the axis: the rotation vector is at right angles to it, before and after.
    EXPECT_NEAR(vector_from_rotation(move.rotation).dot(model.direction), 0, 1e-9);
  }
}

TEST(Axis, IsRefusedFromViewsOfTheSameSide) {
  std::vector<Plane> planes;
  for (double angle : {0.0, 4.0}) {
    const Camera camera = radiograph::camera(angle);
    const auto lines = tube::borders(camera, {0, 0, 0}, {0, 0, 1}, 14, 50, 400);
    planes.push_back(bisecting_plane(camera, lines.left, lines.right));
  }
  EXPECT_EQ(message_of([&] { axis_of_planes(planes); }),
            "the 2 views see the shaft from nearly the same side: the planes of its axis meet at 4.0 degrees, but 10 "
            "are needed; use views farther apart, or a single one");
}

}  // namespace marrow::test::axis_test

namespace marrow::test::manual_test {

Pose manual(Inputs inputs, const Mesh& model, const Options& options) {
  inputs["model"] = item(model);
  return output<Pose>("initial.manual", "pose", inputs, options);
}

TEST(Manual, MovesAboutTheFragmentsOwnAxes) {
  const Mesh model = tube::mesh(
      90, [](double, double) { return 14.0; }, [](double) { return Vector3d(30, 0, 0); });
  const Pose pose = manual({}, model, {{"rotation_deg", Numbers{0, 0, 90}}, {"translation_mm", Numbers{1, 2, 3}}});
  EXPECT_LT((pose.frame.origin_mm - Vector3d(30, 0, 0)).norm(), 1e-9);
  EXPECT_LT((pose.world_from_model * pose.frame.origin_mm - Vector3d(31, 2, 3)).norm(), 1e-6);
  EXPECT_LT((pose.world_from_model * Vector3d(44, 0, 0) - Vector3d(31, 16, 3)).norm(), 1e-6);
}

TEST(Manual, StartsFromTheNominalPlacement) {
  const Mesh model = tube::cylinder(14, 90);
  const Pose start = pose_at({0, 0, 50}, {0, 0, kPi / 2});
  const Inputs inputs{{"start", item(start)}};
  EXPECT_EQ(manual(inputs, model, {}).world_from_model.translation_mm, start.world_from_model.translation_mm);
  // Along the fragment's own x, which is the world's y here.
  const Pose pose = manual(inputs, model, {{"translation_mm", Numbers{10, 0, 0}}});
  EXPECT_LT((pose.world_from_model.translation_mm - Vector3d(0, 10, 50)).norm(), 1e-9);
}

// The mean distance that a tube's surface moves, by integration: a shift moves all points alike.
TEST(Manual, ScalesToADistance) {
  const Mesh model = tube::cylinder(14, 90);
  Options options{{"translation_mm", Numbers{3, 0, 4}}, {"distance_mm", 12.0}};
  EXPECT_LT((manual({}, model, options).world_from_model.translation_mm - Vector3d(7.2, 0, 9.6)).norm(), 1e-6);
  options["rotation_deg"] = Numbers{5, -3, 2};
  const Pose pose = manual({}, model, options);
  EXPECT_NEAR(mean_distance_mm(model, pose.world_from_model, placed({0, 0, 0}), 3000), 12, 0.05);
}

TEST(Manual, SaysWhatIsWrong) {
  const Inputs tube{{"model", item(tube::cylinder(14, 90))}};
  EXPECT_EQ(refusal("initial.manual", tube, {{"distance_mm", 5.0}}),
            "distance_mm: no multiple of rotation_deg and translation_mm moves the surface that far; give a rotation "
            "or translation, or a shorter distance");
  EXPECT_EQ(
      refusal("initial.manual", tube, {{"needs_start", true}}),
      "there is no start; give the approximate placement of the fragment, in case.yaml under 'start' (docs/case.md)");
  EXPECT_EQ(refusal("initial.manual", {{"model", item(Mesh{})}}), "model: the surface has no triangles");
}

TEST(Manual, SaysThatWithoutAStartTheCtIsTheWorld) {
  Heard listener;
  Inputs inputs{{"model", item(tube::cylinder(14, 90))}};
  call("initial.manual", inputs, {}, listener.context);
  EXPECT_EQ(listener.warnings,
            Strings{"there is no start, so CT coordinates are taken as world coordinates; if the bone is elsewhere in "
                    "the images, give its approximate placement, in case.yaml under 'start' (docs/case.md)"});
  listener.warnings.clear();
  inputs["start"] = item(Pose());
  call("initial.manual", inputs, {}, listener.context);
  EXPECT_TRUE(listener.warnings.empty());
}

}  // namespace marrow::test::manual_test
