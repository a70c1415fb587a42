// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>

#include "other_fragment.hpp"
#include "shipped.hpp"
#include "tests/plugins/project/shapes.hpp"

namespace gradient_projection_test {

using marrow::RigidTransform;

constexpr double kRadius_mm = 18;
const Eigen::Vector3d kMiddle_mm(0, 0, kRadius_mm);

marrow::Volume ball() {
  marrow::Volume volume;
  volume.grid.size = {60, 60, 60};
  volume.grid.origin_mm = kMiddle_mm - Eigen::Vector3d::Constant(29.5);
  for (int z = 0; z < 60; ++z)
    for (int y = 0; y < 60; ++y)
      for (int x = 0; x < 60; ++x) {
        const double depth =
            kRadius_mm - (volume.grid.point_from_index({double(x), double(y), double(z)}) - kMiddle_mm).norm();
        volume.values.push_back(float(800 * std::clamp(depth + 0.5, 0.0, 1.0)));
      }
  return volume;
}

/// The ball as a view shows it: chords, in an image of 16 bits.
marrow::View view_of(double angle) {
  marrow::View view{angle > 0 ? "lateral" : "frontal", {}, shapes::c_arm(angle, 256), {}};
  view.image.pixels = cv::Mat(256, 256, CV_16U);
  const Eigen::Vector3d source = marrow::source_position_mm(view.camera);
  for (int v = 0; v < 256; ++v)
    for (int u = 0; u < 256; ++u) {
      const double passed = source.cross(marrow::ray_direction(view.camera, Eigen::Vector2d(u, v))).norm();
      const double chord = passed < kRadius_mm ? 2 * std::sqrt(kRadius_mm * kRadius_mm - passed * passed) : 0;
      view.image.pixels.at<std::uint16_t>(v, u) = std::uint16_t(40000 * std::exp(-0.02 * chord));
    }
  return view;
}

shipped::Inputs inputs() {
  marrow::List<marrow::View> views;
  for (const double angle : {0.0, 90.0}) views.add(angle > 0 ? "lateral" : "frontal", view_of(angle));
  return {{"model", shipped::item(shapes::sphere(kRadius_mm))},
          {"volume", shipped::item(ball())},
          {"views", shipped::list(views, "view")}};
}

RigidTransform shifted(double x, double y, double z) {
  return shapes::centred_at(kMiddle_mm - Eigen::Vector3d(x, y, z));
}

TEST(GradientProjection, IsBestAtTheTruth) {
  const shipped::Inputs in = inputs();
  const marrow::Value made = shipped::call("similarity.gradient_projection", in).at("cost");
  const auto value = [&](double x, double y, double z) { return made.as<marrow::Cost>().value(shifted(x, y, z)); };
  const double best = value(0, 0, 0);
  EXPECT_LT(best, 0.4);
  for (const Eigen::Vector3d& axis : {Eigen::Vector3d(1, 0, 0), Eigen::Vector3d(0, 1, 0), Eigen::Vector3d(0, 0, 1)})
    for (const double side : {-1.0, 1.0}) {
      const auto at = [&](double by) {
        const Eigen::Vector3d p = side * by * axis;
        return value(p.x(), p.y(), p.z());
      };
      EXPECT_GT(at(1), best);
      EXPECT_GT(at(3), at(1));
      EXPECT_GT(at(6), at(3));
    }
  EXPECT_NEAR(value(0, 0, 500), 1, 1e-12) << "out of view";
  EXPECT_NEAR(value(0, -900, 0), 1, 0.2) << "behind one of two sources";
}

TEST(GradientProjection, ALevelSmoothsTheImagesAsMuchMoreAsItsPixelsAreWider) {
  const shipped::Inputs in = inputs();
  const auto cost = [&](double blur_px) {
    return shipped::call("similarity.gradient_projection", in, {{"sigma_px", blur_px}}).at("cost");
  };
  const marrow::Value fine = cost(1.5), smooth = cost(4.5);
  for (const double off_mm : {0.0, 2.0})
    EXPECT_EQ(fine.as<marrow::Cost>().at_level({1, 8, 3})->value(shifted(off_mm, 0, 0)),
              smooth.as<marrow::Cost>().value(shifted(off_mm, 0, 0)))
        << off_mm;
}

TEST(GradientProjection, WhatLiesBehindTheSourceIsNotSeen) {
  shipped::Inputs in = inputs();
  marrow::List<marrow::View> views;
  marrow::View view = view_of(0);
  view.image.pixels = 60000 - view.image.pixels;
  views.add("frontal", view);
  in["views"] = shipped::list(views, "view");
  const marrow::Value made = shipped::call("similarity.gradient_projection", in).at("cost");
  // Mirrored through the source, the ball would be projected to the same place, upside down. Its gradients would then
  // fit a bright ball.
  const Eigen::Vector3d behind_mm = 2 * marrow::source_position_mm(views[0].camera);
  for (const double off_mm : {-3.0, 0.0, 4.0})
    EXPECT_EQ(made.as<marrow::Cost>().value(shifted(behind_mm.x() + off_mm, behind_mm.y(), behind_mm.z() - off_mm)), 1)
        << off_mm;
}

TEST(GradientProjection, DirectionsCount) {
  // A bright ball: all gradients point the other way.
  shipped::Inputs in = inputs();
  marrow::List<marrow::View> views;
  for (const double angle : {0.0, 90.0}) {
    marrow::View view = view_of(angle);
    view.image.pixels = 60000 - view.image.pixels;
    views.add(view.name, view);
  }
  in["views"] = shipped::list(views, "view");
  const marrow::Value made = shipped::call("similarity.gradient_projection", in).at("cost");
  EXPECT_NEAR(made.as<marrow::Cost>().value(shifted(0, 0, 0)), 1, 1e-6);
}

TEST(GradientProjection, ABrightSpotCountsTwiceAtMost) {
  // Beside the ball lies a small one that the images do not show. It only adds to the sum that the points could reach.
  const Eigen::Vector3d spot_mm = kMiddle_mm + Eigen::Vector3d(20, 20, 20);
  constexpr double kSpot_mm = 6;
  marrow::Mesh mesh = shapes::sphere(kRadius_mm), spot = shapes::sphere(kSpot_mm);
  const auto first = std::uint32_t(mesh.vertices_mm.size());
  for (const Eigen::Vector3d& vertex : spot.vertices_mm)
    mesh.vertices_mm.push_back(vertex + spot_mm - Eigen::Vector3d(0, 0, kSpot_mm));
  for (const auto& t : spot.triangles) mesh.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
  const auto possible = [&](double brightness) {
    marrow::Volume volume = ball();
    for (std::size_t i = 0; i < volume.values.size(); ++i) {
      const Eigen::Vector3d index(double(i % 60), double(i / 60 % 60), double(i / 3600));
      const double depth = kSpot_mm - (volume.grid.point_from_index(index) - spot_mm).norm();
      volume.values[i] += float(brightness * 800 * std::clamp(depth + 0.5, 0.0, 1.0));
    }
    shipped::Inputs in = inputs();
    in["model"] = shipped::item(mesh);
    in["volume"] = shipped::item(volume);
    return 1 /
           (1 -
            shipped::call("similarity.gradient_projection", in).at("cost").as<marrow::Cost>().value(shifted(0, 0, 0)));
  };
  const double none = possible(0.001), as_bright = possible(1) - none, far_brighter = possible(100) - none;
  EXPECT_GT(as_bright, 0.02);
  EXPECT_NEAR(far_brighter / as_bright, 2, 0.4);
}

TEST(GradientProjection, WhatIsMaskedDoesNotCount) {
  const auto value = [](double grey) {
    marrow::View view = view_of(0);
    view.mask = cv::Mat(256, 256, CV_8U, cv::Scalar(0));
    view.mask(cv::Rect(30, 30, 105, 190)).setTo(1);
    view.image.pixels.setTo(grey, view.mask == 0);
    marrow::List<marrow::View> views;
    views.add("frontal", view);
    shipped::Inputs in = inputs();
    in["views"] = shipped::list(views, "view");
    return shipped::call("similarity.gradient_projection", in)
        .at("cost")
        .as<marrow::Cost>()
        .value(shifted(0.3, 0, 0.6));
  };
  EXPECT_LT(value(20000), 0.9) << "some of the outline is left";
  EXPECT_NEAR(value(5), value(60000), 1e-6) << "line integrals are relative to the brightest pixel";
}

TEST(GradientProjection, AnotherFragmentsShadowDoesNotCount) {
  const other_fragment::Fragments<marrow::RadiographProjector> fragments{
      std::make_shared<const other_fragment::SquareProjector>(),
      std::make_shared<const other_fragment::SquareProjector>()};
  const auto unknown = [](const shipped::Inputs& in) { return in; };
  const auto as_radiograph = [&](const shipped::Inputs& in) { return fragments.with(in); };
  const auto as_outline = [](const shipped::Inputs& in) {
    return other_fragment::with_outline(in, std::make_shared<const other_fragment::SquareOutline>());
  };
  const auto value = [](double grey, const auto& told) {
    marrow::List<marrow::View> views;
    for (const double angle : {0.0, 90.0}) {
      marrow::View view = view_of(angle);
      view.image.pixels(cv::Rect(100, 60, 30, 30)).setTo(grey);
      views.add(view.name, view);
    }
    shipped::Inputs in = inputs();
    in["views"] = shipped::list(views, "view");
    const marrow::Value made = shipped::call("similarity.gradient_projection", told(in)).at("cost");
    return made.as<marrow::Cost>().value(shifted(0, 0, 9));
  };
  EXPECT_GT(std::abs(value(5000, unknown) - value(39000, unknown)), 0.01);
  EXPECT_NEAR(value(5000, as_radiograph), value(39000, as_radiograph), 1e-9);
  EXPECT_NEAR(value(5000, as_outline), value(39000, as_outline), 1e-9);
}

TEST(GradientProjection, AnEvenImageIsTheWorst) {
  shipped::Inputs in = inputs();
  marrow::View view = view_of(0);
  view.image.pixels = cv::Mat(256, 256, CV_16U, cv::Scalar(20000));
  marrow::List<marrow::View> views;
  views.add("frontal", view);
  in["views"] = shipped::list(views, "view");
  const marrow::Value made = shipped::call("similarity.gradient_projection", in).at("cost");
  EXPECT_EQ(made.as<marrow::Cost>().value(shifted(0, 0, 0)), 1);
}

TEST(GradientProjection, ImagesThatAreTurnedBy180DegreesGiveTheSame) {
  marrow::View view = view_of(0), turned = view;
  cv::rotate(view.image.pixels, turned.image.pixels, cv::ROTATE_180);
  const Eigen::Matrix3d about_axis = Eigen::Vector3d(-1, -1, 1).asDiagonal();
  turned.camera.camera_from_world.rotation = about_axis * view.camera.camera_from_world.rotation;
  turned.camera.camera_from_world.translation_mm = about_axis * view.camera.camera_from_world.translation_mm;
  for (int i : {0, 1}) turned.camera.intrinsics(i, 2) = 255 - view.camera.intrinsics(i, 2);
  const auto cost_of = [](const marrow::View& seen) {
    marrow::List<marrow::View> views;
    views.add("frontal", seen);
    shipped::Inputs in = inputs();
    in["views"] = shipped::list(views, "view");
    return shipped::call("similarity.gradient_projection", in).at("cost");
  };
  const marrow::Value straight = cost_of(view), other = cost_of(turned);
  for (const double x : {0.0, 1.3, 4.1})
    EXPECT_NEAR(straight.as<marrow::Cost>().value(shifted(x, 0.4, 2.2)),
                other.as<marrow::Cost>().value(shifted(x, 0.4, 2.2)), 1e-5);
}

TEST(GradientProjection, SaysWhatIsWrong) {
  shipped::Inputs in = inputs();
  marrow::Volume even = ball();
  even.values.assign(even.values.size(), 100);
  in["volume"] = shipped::item(even);
  EXPECT_EQ(shipped::refusal("similarity.gradient_projection", in),
            "the volume has no gradient on the mesh: wire the volume that the mesh was made from");
}

TEST(GradientProjection, SaysWhatIsEmpty) {
  const auto said = [](const shipped::Inputs& in, const RigidTransform& pose) {
    return shipped::call("similarity.gradient_projection", in).at("cost").as<marrow::Cost>().nothing_compared(pose);
  };
  EXPECT_EQ(said(inputs(), shifted(1, 0, 0)), "");
  EXPECT_EQ(said(inputs(), shifted(0, 0, 500)),
            "view 'frontal': no part of the bone that rays touch lies inside image and mask; "
            "view 'lateral': no part of the bone that rays touch lies inside image and mask");
  shipped::Inputs constant = inputs();
  marrow::List<marrow::View> views;
  marrow::View view = view_of(0);
  view.image.pixels.setTo(30000);
  views.add("frontal", view);
  constant["views"] = shipped::list(views, "view");
  EXPECT_EQ(said(constant, shifted(0, 0, 0)),
            "view 'frontal': it has no gradient like the CT's where rays touch the bone");
}

}  // namespace gradient_projection_test
