// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <chrono>

#include "marrow/initial/model_borders.hpp"
#include "shipped.hpp"
#include "tests/plugins/edges/radiograph.hpp"
#include "tests/plugins/initial/tube.hpp"

namespace shaft_axis_test {

using marrow::List, marrow::Mesh, marrow::Pose, marrow::RigidTransform, marrow::ShaftLines, marrow::View, tube::posed;

shipped::Inputs inputs_of(const Mesh& model, const List<ShaftLines>& lines, const List<View>& views,
                          const Pose* start) {
  shipped::Inputs inputs{{"model", shipped::item(model)},
                         {"lines", shipped::list(lines, "view")},
                         {"views", shipped::list(views, "view")}};
  if (start) inputs["start"] = shipped::item(*start);
  return inputs;
}
Pose shaft_axis(const Mesh& model, const List<ShaftLines>& lines, const List<View>& views, const Pose* start,
                const shipped::Options& options = {}) {
  return shipped::call("initial.shaft_axis", inputs_of(model, lines, views, start), options).at("pose").as<Pose>();
}
std::string refusal(const Mesh& model, const List<ShaftLines>& lines, const List<View>& views, const Pose* start) {
  return shipped::refusal("initial.shaft_axis", inputs_of(model, lines, views, start));
}

/// Views from the angles, with the borders that the model at its true pose shows between two heights of the image.
struct TrueViews {
  List<View> views;
  List<ShaftLines> lines;
  TrueViews(const Mesh& model, const RigidTransform& truth, const std::vector<double>& angles) {
    for (double angle : angles) {
      View view;
      view.name = "at " + std::to_string(int(angle));
      view.camera = radiograph::camera(angle);
      ShaftLines window;
      window.left = {{300, 60}, {300, 350}};
      window.right = {{200, 60}, {200, 350}};
      const auto borders = *marrow::initial::model_borders(model, truth, view.camera, window, 3);
      ShaftLines seen;
      seen.left = borders.left;
      seen.right = borders.right;
      views.add(view.name, view);
      lines.add(view.name, seen);
    }
  }
};

/// Errors of the axis at the fragment's origin: angle between long axes, and distance across the axis.
std::pair<double, double> axis_errors(const Pose& pose, const RigidTransform& truth) {
  const Eigen::Vector3d z = truth.rotation * pose.frame.axes.col(2),
                        found = pose.world_from_model.rotation * pose.frame.axes.col(2);
  const Eigen::Vector3d off = pose.world_from_model * pose.frame.origin_mm - truth * pose.frame.origin_mm;
  return {marrow::degrees(std::atan2(z.cross(found).norm(), z.dot(found))), (off - z * z.dot(off)).norm()};
}

TEST(ShaftAxis, FindsTheAxisOfACylinderFromTwoAndThreeViews) {
  const Mesh model = tube::cylinder(14, 90);
  const RigidTransform truth = posed({4, -6, 0}, {8, -5, 3});
  for (const std::vector<double>& angles : {std::vector<double>{0, 90}, {0, 60, 120}}) {
    List<View> views;
    List<ShaftLines> lines;
    for (double angle : angles) {
      View view;
      view.name = "at " + std::to_string(int(angle));
      view.camera = radiograph::camera(angle);
      views.add(view.name, view);
      lines.add(view.name, tube::borders(view.camera, truth.translation_mm, truth.rotation.col(2), 14, 60, 350));
    }
    const Pose pose = shaft_axis(model, lines, views, nullptr);
    const auto [turned_deg, off_mm] = axis_errors(pose, truth);
    std::printf("cylinder, %zu views: %.4f deg, %.4f mm, %d rounds\n", angles.size(), turned_deg, off_mm,
                pose.evaluations);
    EXPECT_LT(turned_deg, 0.02);
    EXPECT_LT(off_mm, 0.02);
    EXPECT_TRUE(pose.warnings.empty());
    EXPECT_EQ(pose.world_from_model.source, "ct");
    EXPECT_EQ(pose.frame.origin_mm, marrow::fragment_frame(model).origin_mm);
  }
}

// A bow of 900 mm radius to the front, a taper of 2 degrees on each side and a ridge of 4 mm at the back: none of them
// moves the axis, because the model is measured in the same way as the image.
TEST(ShaftAxis, IsNotMisledByBowTaperAndRidge) {
  const Mesh model = tube::mesh(
      90,
      [](double z, double angle) {
        return 14 - 0.035 * z +
               4 * std::exp(-std::pow(std::remainder(angle - marrow::kPi / 2, 2 * marrow::kPi) / 0.3, 2));
      },
      [](double z) { return Eigen::Vector3d(0, z * z / 1800, 0); });
  for (const Eigen::Vector3d& tilt : {Eigen::Vector3d(5, -4, 0), Eigen::Vector3d(-8, 3, 0)}) {
    const RigidTransform truth = posed(tilt, {6, -9, 0});
    const TrueViews setup(model, truth, {0, 90});
    const auto before = std::chrono::steady_clock::now();
    const Pose pose = shaft_axis(model, setup.lines, setup.views, nullptr);
    const double ms = std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - before).count();
    const auto [turned_deg, off_mm] = axis_errors(pose, truth);
    std::printf("bowed, tapered, ridged: %.4f deg, %.4f mm, %d rounds, %.1f ms, %zu triangles\n", turned_deg, off_mm,
                pose.evaluations, ms, model.triangles.size());
    EXPECT_LT(turned_deg, 0.3);
    EXPECT_LT(off_mm, 0.5);
  }
}

TEST(ShaftAxis, KeepsRotationAboutAndPlaceAlongTheAxisFromTheStart) {
  const Mesh model = tube::cylinder(14, 90);
  const RigidTransform truth = posed({4, -6, 0}, {8, -5, 3});
  const TrueViews setup(model, truth, {0, 90});
  Pose start;
  start.world_from_model = posed({0, 0, 25}, {0, 0, 7});
  const Pose pose = shaft_axis(model, setup.lines, setup.views, &start);
  const Eigen::Matrix3d turn = pose.world_from_model.rotation * start.world_from_model.rotation.transpose();
  EXPECT_NEAR(marrow::vector_from_rotation(turn).dot(Eigen::Vector3d::UnitZ()), 0, 1e-3);
  const Eigen::Vector3d axis = truth.rotation.col(2);
  EXPECT_NEAR(axis.dot(pose.world_from_model.translation_mm - Eigen::Vector3d(0, 0, 7)), 0, 0.15);
}

TEST(ShaftAxis, TakesTheDepthOfASingleViewFromTheWidth) {
  const Mesh model = tube::cylinder(14, 90);
  const RigidTransform truth = posed({0, 5, 0}, {9, 30, 0});  // 30 mm farther from the source than the start
  const TrueViews setup(model, truth, {0});
  const shipped::Options exact{{"border_inset_mm", 0.0}};  // these borders are those of the silhouette itself
  const Pose pose = shaft_axis(model, setup.lines, setup.views, nullptr, exact);
  const Eigen::Vector3d off = pose.world_from_model * pose.frame.origin_mm - truth * pose.frame.origin_mm;
  const auto [turned_deg, off_mm] = axis_errors(pose, truth);
  std::printf("one view: %.3f deg, depth off by %.3f mm, across the image %.3f mm\n", turned_deg, off.y(), off.x());
  EXPECT_LT(turned_deg, 0.3);
  EXPECT_LT(std::abs(off.y()), 1.0);
  EXPECT_LT(std::abs(off.x()), 0.3);
}

TEST(ShaftAxis, LeavesAPerfectStartWhereItIs) {
  const Mesh model = tube::cylinder(14, 90);
  Pose start;
  start.world_from_model = posed({6, 5, 40}, {9, -12, 0});
  for (const std::vector<double>& angles : {std::vector<double>{0}, {0, 90}, {0, 60, 120}}) {
    const TrueViews setup(model, start.world_from_model, angles);
    const Pose pose = shaft_axis(model, setup.lines, setup.views, &start, {{"border_inset_mm", 0.0}});
    const auto [turned_deg, off_mm] = axis_errors(pose, start.world_from_model);
    EXPECT_LT(turned_deg, 0.02);
    EXPECT_LT(off_mm, 0.02);
  }
}

TEST(ShaftAxis, WarnsOfBordersThatAreNotThoseOfTheModel) {
  const Mesh model = tube::cylinder(14, 90);
  TrueViews setup(model, posed({0, 0, 0}, {0, 0, 0}), {0});
  View side = setup.views[0];
  side.camera = radiograph::camera(90);
  setup.views.add("lateral", side);
  setup.lines.add("lateral", tube::borders(side.camera, {0, 0, 0}, {0, 0, 1}, 19, 60, 350));
  const Pose pose = shaft_axis(model, setup.lines, setup.views, nullptr);
  ASSERT_EQ(pose.warnings.size(), 1u);
  EXPECT_EQ(pose.warnings[0],
            "view 'lateral': the shaft's borders are 39.0 mm apart, where the model is 28.0 mm wide; they may belong "
            "to something else");
}

// As in an image of a fracture: the shaft that was found belongs to the other fragment, below this one. This fragment's
// own pair was rejected, and comes after a canal and a pair that is too short.
TEST(ShaftAxis, TakesTheLinesWhereTheFragmentIs) {
  const Mesh model = tube::cylinder(14, 45);
  const RigidTransform truth = posed({4, -6, 0}, {8, -5, 50});
  List<View> views;
  List<ShaftLines> lines;
  for (double angle : {0.0, 90.0}) {
    View view;
    view.name = "at " + std::to_string(int(angle));
    view.camera = radiograph::camera(angle);
    const auto pair = [&](double radius_mm, double from_v, double to_v) {
      return tube::borders(view.camera, truth.translation_mm, truth.rotation.col(2), radius_mm, from_v, to_v);
    };
    const double middle_v = marrow::project(view.camera, truth.translation_mm).y();
    ShaftLines found = tube::borders(view.camera, {0, 0, -60}, {0, 0, 1}, 14, middle_v + 200, middle_v + 350);
    for (const ShaftLines& other : {pair(6, middle_v - 80, middle_v + 80), pair(14.5, middle_v - 10, middle_v + 10),
                                    pair(14, middle_v - 80, middle_v + 80)})
      found.rejected.push_back({other.left, other.right, "outdone"});
    views.add(view.name, view);
    lines.add(view.name, found);
  }
  Pose start;
  start.world_from_model = posed({0, 0, 0}, {0, 0, 50});
  const Pose pose = shaft_axis(model, lines, views, &start);
  const auto [turned_deg, off_mm] = axis_errors(pose, truth);
  std::printf("second pair: %.4f deg, %.4f mm\n", turned_deg, off_mm);
  EXPECT_LT(turned_deg, 0.02);
  EXPECT_LT(off_mm, 0.02);
}

TEST(ShaftAxis, SaysWhatIsMissing) {
  const Mesh model = tube::cylinder(14, 90);
  TrueViews setup(model, posed({0, 0, 0}, {0, 0, 0}), {0, 90});
  const List<View> one_view = [&] {
    List<View> list;
    list.add("at 0", setup.views[0]);
    return list;
  }();
  EXPECT_EQ(refusal(model, setup.lines, one_view, nullptr),
            "there are shaft lines of a view 'at 90', but no view of that name");
  Pose behind;
  behind.world_from_model.translation_mm = {0, -700, 0};
  EXPECT_EQ(refusal(model, setup.lines, setup.views, &behind),
            "view 'at 0': the model does not lie in front of the X-ray source; give a start nearer to the bone");
  EXPECT_EQ(refusal(model, {}, setup.views, nullptr), "there are no shaft lines; wire the lines of at least one view");
  Pose far;
  far.world_from_model.translation_mm = {0, 0, 400};
  EXPECT_EQ(refusal(model, setup.lines, setup.views, &far),
            "view 'at 0': the model at its start is not where the image shows the shaft, and no other pair of lines "
            "fits it; give a start nearer to the bone");
  List<ShaftLines> empty_lines;
  empty_lines.add("at 0", ShaftLines{});
  EXPECT_EQ(refusal(model, empty_lines, setup.views, nullptr), "view 'at 0': a border of the shaft has no length");
  EXPECT_EQ(refusal(Mesh{}, setup.lines, setup.views, nullptr), "model: the surface has no triangles");
}

}  // namespace shaft_axis_test
