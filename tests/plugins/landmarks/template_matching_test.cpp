// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/analytic/body.hpp"
#include "tests/harness/node_test.hpp"

namespace marrow::test::template_matching_test {

constexpr int kSize_px = 240;

analytic::Body bone() {
  return {{{0, 0, 60}, {13, 12, 90}}, {{24, -5, -38}, {11, 15, 13}}, {{-22, 8, -32}, {13, 11, 15}}};
}

RigidTransform unmoved() { return analytic::moved_by({0, 0, 0}, {0, 0, 0}); }

/// A view of the bone, exactly drawn. 0.48 mm a pixel at the world's origin.
View view_of(const RigidTransform& world_from_ct) {
  View view;
  view.name = "frontal";
  view.camera = analytic::c_arm(0, kSize_px, kSize_px, 0.8);
  const auto chords =
      analytic::BodyProjector(bone()).radiograph(view.camera, world_from_ct, PixelGrid{0, 0, 1, kSize_px, kSize_px});
  view.image.pixels.create(kSize_px, kSize_px, CV_16U);
  for (std::size_t i = 0; i < chords.size(); ++i)
    view.image.pixels.ptr<std::uint16_t>()[i] = std::uint16_t(50000 * std::exp(-0.02 * chords[i]));
  return view;
}

Inputs inputs(const View& view, const RigidTransform& start) {
  Landmarks points;
  points.points = {{"lateral", {35, -5, -38}}, {"medial", {-35, 8, -32}}};
  List<View> views;
  views.add(view.name, view);
  Pose pose;
  pose.world_from_model = start;
  return {{"points", item(points)},
          {"views", shipped::list(views, "view")},
          {"projector", Value::of<RadiographProjector>(std::make_shared<const analytic::BodyProjector>(bone()))},
          {"start", item(pose)}};
}

Landmarks found(const View& view, const RigidTransform& start, const Options& options = {}) {
  return output<Landmarks>("landmarks.template_matching", "landmarks", inputs(view, start), options);
}

double worst_px(const Landmarks& landmarks, const View& view, const RigidTransform& truth) {
  double worst = 0;
  for (const auto& seen : landmarks.seen)
    for (const auto& point : landmarks.points)
      if (point.name == seen.name)
        worst = std::max(worst, (seen.pixel - project(view.camera, truth * point.model_mm)).norm());
  return worst;
}

/// A start that a turn about the beam and a shift across it lead to: the picture moves and hardly changes.
RigidTransform start_of(const View& view, double turn_deg) {
  const Matrix3d camera_from_world = view.camera.camera_from_world.rotation;
  return analytic::moved_by(radians(turn_deg) * camera_from_world.row(2).transpose(),
                            camera_from_world.transpose() * Vector3d(5, -4, 0));
}

TEST(TemplateMatching, FollowsAShift) {
  const View shown = view_of(unmoved());
  const Landmarks landmarks = found(shown, start_of(shown, 0));
  ASSERT_EQ(landmarks.seen.size(), 2u);
  EXPECT_LT(worst_px(landmarks, shown, unmoved()), 0.7);
  for (const auto& seen : landmarks.seen) {
    EXPECT_GT(seen.deviation_px, 0.01);
    EXPECT_LT(seen.deviation_px, 4);
  }
}

TEST(TemplateMatching, TurnsTheRadiographInItsPlane) {
  const View shown = view_of(unmoved());
  const RigidTransform start = start_of(shown, 8);
  const Landmarks turned = found(shown, start);
  ASSERT_EQ(turned.seen.size(), 2u);
  EXPECT_LT(worst_px(turned, shown, unmoved()), 2.5) << "round condyles look nearly the same when they are turned";
  EXPECT_GT(worst_px(found(shown, start, {{"turn_step_deg", 0.0}}), shown, unmoved()), 3.5);
}

TEST(TemplateMatching, StatesTwiceTheDeviationForAFactorOfTwo) {
  const RigidTransform start = analytic::moved_by({0, 0.05, 0}, {3, 0, 2});
  const Landmarks once = found(view_of(unmoved()), start),
                  twice = found(view_of(unmoved()), start, {{"deviation_factor", 2.0}});
  ASSERT_EQ(once.seen.size(), 2u);
  EXPECT_NEAR(twice.seen[0].deviation_px, 2 * once.seen[0].deviation_px, 1e-9);
}

TEST(TemplateMatching, SeesNothingWhereNothingIsAlike) {
  View empty = view_of(unmoved());
  empty.image.pixels.setTo(30000);
  EXPECT_TRUE(found(empty, unmoved()).seen.empty());
  EXPECT_TRUE(found(view_of(unmoved()), analytic::moved_by({0, 0, 0}, {0, 0, 400})).seen.empty()) << "out of view";
}

TEST(TemplateMatching, RefusesAStartBehindTheSource) {
  const View shown = view_of(unmoved());
  EXPECT_EQ(refusal("landmarks.template_matching",
                    inputs(shown, analytic::moved_by({0, 0, 0}, 2 * source_position_mm(shown.camera)))),
            "view 'frontal': the start puts the points behind the source; is it in the world's frame?");
}

}  // namespace marrow::test::template_matching_test
