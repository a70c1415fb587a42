// SPDX-License-Identifier: Apache-2.0
#include "tests/plugins/initial/tube.hpp"

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
  EXPECT_EQ(
      refusal("initial.manual", tube, {{"distance_mm", 5.0}}),
      "distance_mm: no multiple of rotation_deg and translation_mm moves the surface that far; give a rotation or "
      "translation, or a shorter distance");
  EXPECT_EQ(
      refusal("initial.manual", tube, {{"needs_start", true}}),
      "there is no start; give the approximate placement of the fragment, in case.yaml under 'start' (docs/case.md)");
  EXPECT_EQ(refusal("initial.manual", {{"model", item(Mesh{})}}), "model: the surface has no triangles");
}

TEST(Manual, SaysThatWithoutAStartTheCtIsTheWorld) {
  Heard listener;
  Inputs inputs{{"model", item(tube::cylinder(14, 90))}};
  call("initial.manual", inputs, {}, listener.context);
  EXPECT_EQ(
      listener.warnings,
      Strings{"there is no start, so CT coordinates are taken as world coordinates; if the bone is elsewhere in the "
              "images, give its approximate placement, in case.yaml under 'start' (docs/case.md)"});
  listener.warnings.clear();
  inputs["start"] = item(Pose());
  call("initial.manual", inputs, {}, listener.context);
  EXPECT_TRUE(listener.warnings.empty());
}

}  // namespace marrow::test::manual_test
