// SPDX-License-Identifier: Apache-2.0
#include <opencv2/imgproc.hpp>

#include "tests/plugins/project/shapes.hpp"
#include "tests/plugins/similarity/blob_scene.hpp"

namespace marrow::test::gradient_projection_test {

constexpr const char* kNode = "similarity.gradient_projection";
constexpr double kRadius_mm = 18;
const Vector3d kMiddle_mm(0, 0, kRadius_mm);

/// A ball, and a small one elsewhere.
Volume ball(double spot = 0, const Vector3d& spot_mm = {0, 0, 0}, double spot_radius_mm = 0) {
  const auto share = [](double radius_mm, double from_mm) { return std::clamp(radius_mm - from_mm + 0.5, 0.0, 1.0); };
  return volume_by(grid_at({60, 60, 60}, kMiddle_mm - Vector3d::Constant(29.5)), [&](const Vector3d& p) {
    return 800 * (share(kRadius_mm, (p - kMiddle_mm).norm()) + spot * share(spot_radius_mm, (p - spot_mm).norm()));
  });
}

/// The ball as a view shows it: chords, in an image of 16 bits.
View view_of(double angle_deg) {
  const Camera camera = c_arm(angle_deg, 256);
  const Vector3d source = source_position_mm(camera);
  return test::view_of(
      angle_deg > 0 ? "lateral" : "frontal", camera, image_of<std::uint16_t>(256, 256, [&](int u, int v) {
        const double passed = source.cross(ray_direction(camera, Vector2d(u, v))).norm();
        const double chord = passed < kRadius_mm ? 2 * std::sqrt(kRadius_mm * kRadius_mm - passed * passed) : 0;
        return 40000 * std::exp(-0.02 * chord);
      }));
}
/// A bright ball: all gradients point the other way.
View inverted(View view) {
  view.image.pixels = 60000 - view.image.pixels;
  return view;
}

Inputs inputs(const Value& views = each_view(view_of(0), view_of(90))) {
  return {{"model", item(shapes::sphere(kRadius_mm))}, {"volume", item(ball())}, {"views", views}};
}
std::shared_ptr<const Cost> cost(const Inputs& in, const Options& options = {}) { return cost_by(kNode, in, options); }

RigidTransform shifted(double x, double y, double z) { return shapes::centred_at(kMiddle_mm - Vector3d(x, y, z)); }
const RigidTransform kTruth = shifted(0, 0, 0);

TEST(GradientProjection, IsBestAtTheTruth) {
  const auto made = cost(inputs());
  const double best = made->value(kTruth);
  EXPECT_LT(best, 0.4);
  for (int axis = 0; axis < 3; ++axis)
    for (const double side : {-1.0, 1.0}) {
      const auto at = [&](double by) {
        const Vector3d p = side * by * Vector3d::Unit(axis);
        return made->value(shifted(p.x(), p.y(), p.z()));
      };
      EXPECT_GT(at(1), best);
      EXPECT_GT(at(3), at(1));
      EXPECT_GT(at(6), at(3));
    }
  EXPECT_NEAR(made->value(shifted(0, 0, 500)), 1, 1e-12) << "out of view";
  EXPECT_NEAR(made->value(shifted(0, -900, 0)), 1, 0.2) << "behind one of two sources";
}

TEST(GradientProjection, ALevelSmoothsTheImagesAsMuchMoreAsItsPixelsAreWider) {
  const auto fine = cost(inputs(), {{"sigma_px", 1.5}}), smooth = cost(inputs(), {{"sigma_px", 4.5}});
  for (const double off_mm : {0.0, 2.0})
    EXPECT_EQ(fine->at_level({1, 8, 3})->value(shifted(off_mm, 0, 0)), smooth->value(shifted(off_mm, 0, 0))) << off_mm;
}

TEST(GradientProjection, WhatLiesBehindTheSourceIsNotSeen) {
  const auto made = cost(inputs(each_view(inverted(view_of(0)))));
  // Mirrored through the source, the ball would be projected to the same place, upside down. Its gradients would then
  // fit a bright ball.
  const Vector3d behind_mm = 2 * source_position_mm(view_of(0).camera);
  for (const double off_mm : {-3.0, 0.0, 4.0})
    EXPECT_EQ(made->value(shifted(behind_mm.x() + off_mm, behind_mm.y(), behind_mm.z() - off_mm)), 1) << off_mm;
}

TEST(GradientProjection, DirectionsCount) {
  EXPECT_NEAR(cost(inputs(each_view(inverted(view_of(0)), inverted(view_of(90)))))->value(kTruth), 1, 1e-6);
}

TEST(GradientProjection, ABrightSpotCountsTwiceAtMost) {
  // Beside the ball lies a small one that the images do not show. It only adds to the sum that the points could reach.
  const Vector3d spot_mm = kMiddle_mm + Vector3d(20, 20, 20);
  constexpr double kSpot_mm = 6;
  Mesh mesh = shapes::sphere(kRadius_mm);
  const Mesh spot = shapes::sphere(kSpot_mm);
  const auto first = std::uint32_t(mesh.vertices_mm.size());
  for (const Vector3d& vertex : spot.vertices_mm)
    mesh.vertices_mm.push_back(vertex + spot_mm - Vector3d(0, 0, kSpot_mm));
  for (const auto& t : spot.triangles) mesh.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
  const auto possible = [&](double brightness) {
    const Inputs in = with(inputs(), {{"model", item(mesh)}, {"volume", item(ball(brightness, spot_mm, kSpot_mm))}});
    return 1 / (1 - cost(in)->value(kTruth));
  };
  const double none = possible(0.001), as_bright = possible(1) - none, far_brighter = possible(100) - none;
  EXPECT_GT(as_bright, 0.02);
  EXPECT_NEAR(far_brighter / as_bright, 2, 0.4);
}

TEST(GradientProjection, WhatIsMaskedDoesNotCount) {
  const auto value = [](double grey) {
    View view = view_of(0);
    view.mask = mask_of(view.camera, {30, 30, 105, 190});
    view.image.pixels.setTo(grey, view.mask == 0);
    return cost(inputs(each_view(view)))->value(shifted(0.3, 0, 0.6));
  };
  EXPECT_LT(value(20000), 0.9) << "some of the outline is left";
  EXPECT_NEAR(value(5), value(60000), 1e-6) << "line integrals are relative to the brightest pixel";
}

TEST(GradientProjection, AnotherFragmentsShadowDoesNotCount) {
  const auto as_radiograph = [](const Inputs& in) {
    return blob_scene::beside_another(in, blob_scene::square_shadow(), blob_scene::square_shadow());
  };
  const auto as_outline = [](const Inputs& in) { return blob_scene::beside_outline(in); };
  const auto value = [](double grey, const auto& told) {
    View frontal = view_of(0), lateral = view_of(90);
    for (View* view : {&frontal, &lateral}) view->image.pixels(cv::Rect(100, 60, 30, 30)).setTo(grey);
    return cost(told(inputs(each_view(frontal, lateral))))->value(shifted(0, 0, 9));
  };
  EXPECT_GT(std::abs(value(5000, std::identity()) - value(39000, std::identity())), 0.01) << "unless it is known";
  EXPECT_NEAR(value(5000, as_radiograph), value(39000, as_radiograph), 1e-9);
  EXPECT_NEAR(value(5000, as_outline), value(39000, as_outline), 1e-9);
}

TEST(GradientProjection, ImagesThatAreTurnedBy180DegreesGiveTheSame) {
  View view = view_of(0), turned = view;
  cv::rotate(view.image.pixels, turned.image.pixels, cv::ROTATE_180);
  const Matrix3d about_axis = Vector3d(-1, -1, 1).asDiagonal();
  turned.camera.camera_from_world.rotation = about_axis * view.camera.camera_from_world.rotation;
  turned.camera.camera_from_world.translation_mm = about_axis * view.camera.camera_from_world.translation_mm;
  for (int i : {0, 1}) turned.camera.intrinsics(i, 2) = 255 - view.camera.intrinsics(i, 2);
  const auto straight = cost(inputs(each_view(view))), other = cost(inputs(each_view(turned)));
  for (const double x : {0.0, 1.3, 4.1})
    EXPECT_NEAR(straight->value(shifted(x, 0.4, 2.2)), other->value(shifted(x, 0.4, 2.2)), 1e-5);
}

TEST(GradientProjection, SaysWhatIsWrong) {
  Volume even = ball();
  even.values.assign(even.values.size(), 100);
  EXPECT_EQ(refusal(kNode, with(inputs(), {{"volume", item(even)}})),
            "the volume has no gradient on the mesh: wire the volume that the mesh was made from");
}

TEST(GradientProjection, SaysWhatIsEmptyAndIsTheWorst) {
  const auto made = cost(inputs());
  EXPECT_EQ(made->nothing_compared(shifted(1, 0, 0)), "");
  EXPECT_EQ(made->nothing_compared(shifted(0, 0, 500)),
            "view 'frontal': no part of the bone that rays touch lies inside image and mask; view 'lateral': no part "
            "of the bone that rays touch lies inside image and mask");
  View even = view_of(0);
  for (const double grey : {30000, 20000}) {
    even.image.pixels.setTo(grey);
    const auto of_even = cost(inputs(each_view(even)));
    EXPECT_EQ(of_even->value(kTruth), 1);
    EXPECT_EQ(of_even->nothing_compared(kTruth),
              "view 'frontal': it has no gradient like the CT's where rays touch the bone");
  }
}

}  // namespace marrow::test::gradient_projection_test
