// SPDX-License-Identifier: Apache-2.0
// Images as a C-arm exports them, and cameras that are not quite right.
#include <gtest/gtest.h>

#include "nodes.hpp"
#include "shapes.hpp"

namespace export_test {

using namespace marrow;
namespace test = phantom::test;

View even(int grey, int size_px = 64, const std::string& name = "frontal") {
  View view;
  view.name = name;
  view.camera = test::camera(0, size_px);
  view.image.pixels = cv::Mat(size_px, size_px, CV_16U, cv::Scalar(grey));
  return view;
}

List<View> one(const View& view) {
  List<View> views;
  views.add(view.name, view);
  return views;
}

View exported(const View& view, const shipped::Options& options, const View* earlier = nullptr) {
  shipped::Inputs inputs{{"views", shipped::list(one(view), "view")}};
  if (earlier) inputs["earlier_views"] = shipped::list(one(*earlier), "view");
  return shipped::call("simulate.export", inputs, options).at("views").as_list<View>()[0];
}

int eight_bit(int grey, const std::string& level, const shipped::Options& more = {}) {
  shipped::Options options{{"eight_bit", level}};
  options.insert(more.begin(), more.end());
  const View view = exported(even(grey), options);
  EXPECT_EQ(view.image.pixels.type(), CV_8UC1);
  return view.image.pixels.at<std::uint8_t>(30, 30);
}

bool same(const View& a, const View& b) {
  return a.image.pixels.type() == b.image.pixels.type() &&
         std::equal(a.image.pixels.datastart, a.image.pixels.dataend, b.image.pixels.datastart);
}

TEST(SimulateExport, NothingChangesWhenAllIsOff) {
  const View before = even(500), view = even(12345);
  EXPECT_TRUE(same(exported(view, {}), view));
  EXPECT_TRUE(same(exported(view, {}, &before), view));
  EXPECT_TRUE(same(exported(view, {{"lag", std::string("bad")}}), view)) << "no earlier image, no lag";
}

TEST(SimulateExport, LagMixesTheEarlierImage) {
  const View earlier = even(5000);
  const auto grey = [&](const std::string& level) {
    return exported(even(1000), {{"lag", level}}, &earlier).image.pixels.at<std::uint16_t>(9, 9);
  };
  EXPECT_EQ(grey("mild"), 1200);   // 0.95 * 1000 + 0.05 * 5000
  EXPECT_EQ(grey("usual"), 1600);  // 0.85 * 1000 + 0.15 * 5000
  EXPECT_EQ(grey("bad"), 2400);    // 0.65 * 1000 + 0.35 * 5000
}

TEST(SimulateExport, EightBitsWithGamma) {
  EXPECT_EQ(eight_bit(65535, "mild"), 255);
  EXPECT_EQ(eight_bit(0, "mild"), 0);
  EXPECT_EQ(eight_bit(16384, "mild"), 84);  // 255 * 0.25000^0.8 = 84.12
  EXPECT_EQ(eight_bit(6554, "mild"), 40);   // 255 * 0.10001^0.8 = 40.42
  // Saturated first: (16384 - 0) / 50000 = 0.32768; 255 * 0.32768^0.8 = 104.44.
  EXPECT_EQ(eight_bit(16384, "mild", {{"saturation", std::string("mild")}}), 104);
  EXPECT_EQ(eight_bit(60000, "mild", {{"saturation", std::string("mild")}}), 255);
}

TEST(SimulateExport, SaturationCutsWhiteAndBlack) {
  const auto grey = [&](int value) {
    return exported(even(value), {{"saturation", std::string("usual")}}).image.pixels.at<std::uint16_t>(9, 9);
  };
  EXPECT_EQ(grey(40000), 30000);
  EXPECT_EQ(grey(12000), 12000);
  EXPECT_EQ(grey(900), 1500);
}

TEST(SimulateExport, LocalContrastRaisesSmallDifferences) {
  View view = even(12000, 128);
  for (int v = 0; v < 128; ++v)
    for (int u = 0; u < 128; ++u)
      view.image.pixels.at<std::uint16_t>(v, u) = std::uint16_t(11500 + 1000 * ((u / 4) % 2));
  const auto contrast = [&](const std::string& level) {
    const cv::Mat pixels = exported(view, {{"eight_bit", level}}).image.pixels;
    return pixels.at<std::uint8_t>(64, 70) - pixels.at<std::uint8_t>(64, 66);
  };
  EXPECT_GT(std::abs(contrast("bad")), 1.3 * std::abs(contrast("mild")));
}

TEST(SimulateExport, TheCollimatorHasARimWithHalfShadow) {
  const View usual = exported(even(20000, 256), {{"collimator", std::string("usual")}});
  const auto grey = [&](int u) { return int(usual.image.pixels.at<std::uint16_t>(128, u)); };
  EXPECT_EQ(grey(128), 20000);
  EXPECT_NEAR(grey(0), 400, 200);  // 2 % behind the blade
  int half_shadow = 0, covered = 0;
  for (int u = 0; u < 128; ++u) {
    half_shadow += grey(u) > 1000 && grey(u) < 19000;
    covered += grey(u) <= 10000;
  }
  EXPECT_GE(half_shadow, 4);
  EXPECT_LE(half_shadow, 9);
  EXPECT_GE(covered, 2);
  EXPECT_LE(covered, 0.08 * 256 + 1 + 128 * std::tan(radians(2)));
  EXPECT_TRUE(same(usual, exported(even(20000, 256), {{"collimator", std::string("usual")}})));
  EXPECT_FALSE(same(usual, exported(even(20000, 256), {{"collimator", std::string("usual")}, {"collimator_seed", 2}})));
}

TEST(SimulateExport, BadInputIsExplained) {
  View shallow = even(100);
  shallow.image.pixels = cv::Mat(64, 64, CV_8U, cv::Scalar(7));
  EXPECT_EQ(shipped::refusal("simulate.export", {{"views", shipped::list(one(shallow), "view")}}),
            "simulate.export: view 'frontal' is not of 16 bits; give it the views of simulate.fluoroscopy");
  const shipped::Options lag{{"lag", std::string("mild")}};
  const auto refusal = [&](const View& earlier) {
    return shipped::refusal(
        "simulate.export",
        {{"views", shipped::list(one(even(100)), "view")}, {"earlier_views", shipped::list(one(earlier), "view")}},
        lag);
  };
  EXPECT_EQ(refusal(even(100, 64, "lateral")),
            "simulate.export: there is no earlier image of view 'frontal'; give 'earlier_views' the same views");
  EXPECT_EQ(refusal(even(100, 32)), "simulate.export: the earlier image of view 'frontal' has another size");
}

Camera stated(const Camera& camera, int seed, const std::string& level) {
  View view = even(100, 512);
  view.camera = camera;
  return shipped::call("simulate.camera_faults", {{"views", shipped::list(one(view), "view")}},
                       {{"camera_seed", seed}, {"severity", level}})
      .at("views")
      .as_list<View>()[0]
      .camera;
}

TEST(SimulateCameraFaults, HaveTheirRootMeanSquareAndALimit) {
  const Camera camera = test::camera(30, 512);
  constexpr int kSeeds = 3000;
  for (const auto& [level, factor] : {std::pair("mild", 0.5), std::pair("usual", 1.0), std::pair("bad", 2.0)}) {
    std::array<double, 4> squares{}, largest{};
    for (int seed = 0; seed < kSeeds; ++seed) {
      const Camera found = stated(camera, seed, level);
      check_camera(found, level);
      const double rotation =
          degrees(geodesic_angle_rad(found.camera_from_world.rotation, camera.camera_from_world.rotation));
      const Eigen::Vector3d origin = found.camera_from_world.translation_mm - camera.camera_from_world.translation_mm;
      const double focal = 100 * (found.intrinsics(0, 0) / camera.intrinsics(0, 0) - 1);
      const double centre = (found.intrinsics - camera.intrinsics).col(2).norm();
      EXPECT_NEAR(found.intrinsics(1, 1) / found.intrinsics(0, 0), 1, 1e-12);
      const std::array<double, 4> errors{rotation, origin.norm(), focal, centre};
      for (std::size_t k = 0; k < errors.size(); ++k) {
        squares[k] += errors[k] * errors[k] / kSeeds;
        largest[k] = std::max(largest[k], std::abs(errors[k]));
      }
    }
    const std::array<double, 4> expected{0.5, 1, 1, 5};
    for (std::size_t k = 0; k < expected.size(); ++k) {
      EXPECT_NEAR(std::sqrt(squares[k]), factor * expected[k], 0.04 * factor * expected[k]) << level << " " << k;
      EXPECT_LE(largest[k], std::sqrt(3.0) * factor * expected[k] * (1 + 1e-6)) << level << " " << k;
    }
  }
}

TEST(SimulateCameraFaults, OnlyTheNamedViewsAreOff) {
  List<View> views;
  for (const std::string name : {"frontal", "lateral"}) {
    View view = even(100, 512);
    view.name = name;
    view.camera = test::camera(30, 512);
    views.add(name, view);
  }
  const auto call = [&](const std::string& name) {
    return shipped::call("simulate.camera_faults", {{"views", shipped::list(views, "view")}},
                         {{"only", std::vector<std::string>{name}}});
  };
  const auto stated = call("lateral").at("views").as_list<View>();
  EXPECT_EQ(stated[0].camera.camera_from_world.rotation, views[0].camera.camera_from_world.rotation);
  EXPECT_EQ(stated[0].camera.intrinsics, views[0].camera.intrinsics);
  EXPECT_NE(stated[1].camera.camera_from_world.rotation, views[1].camera.camera_from_world.rotation);
  EXPECT_EQ(shipped::refusal("simulate.camera_faults", {{"views", shipped::list(views, "view")}},
                             {{"only", std::vector<std::string>{"lateal"}}}),
            "only: there is no view 'lateal'; did you mean 'lateral'?");
}

TEST(SimulateCameraFaults, OffLeavesTheCamera) {
  const Camera camera = test::camera(30, 512), same = stated(camera, 5, "off");
  EXPECT_EQ(same.intrinsics, camera.intrinsics);
  EXPECT_EQ(same.camera_from_world.rotation, camera.camera_from_world.rotation);
  EXPECT_EQ(same.camera_from_world.translation_mm, camera.camera_from_world.translation_mm);
  EXPECT_NE(stated(camera, 5, "mild").intrinsics, camera.intrinsics);
  EXPECT_EQ(stated(camera, 5, "mild").intrinsics, stated(camera, 5, "mild").intrinsics);
}

}  // namespace export_test
