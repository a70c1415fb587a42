// SPDX-License-Identifier: Apache-2.0
#include "marrow/initial/model_borders.hpp"
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
  EXPECT_EQ(scene.shaft_axis(model).warnings,
            Strings{"view 'at 90': the shaft's borders are 39.0 mm apart, where the model is 28.0 mm wide; they may "
                    "belong to something else"});
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
