// SPDX-License-Identifier: Apache-2.0
// Images as a C-arm exports them, and cameras that are not quite right.
#include "tests/plugins/simulate/phantoms.hpp"

namespace marrow::test::export_test {

using simulated::same;

View even(int grey, int size_px = 64, const std::string& name = "frontal") {
  return view_of(name, simulated::camera(0, size_px), cv::Mat(size_px, size_px, CV_16U, cv::Scalar(grey)));
}
/// A level of a fault.
Options at(const std::string& fault, const std::string& level) { return {{fault, level}}; }

View exported(const View& view, const Options& options, const View* earlier = nullptr) {
  Inputs inputs{{"views", each_view(view)}};
  if (earlier) inputs["earlier_views"] = each_view(*earlier);
  return output_list<View>("simulate.export", "views", inputs, options)[0];
}
int exported_grey(int grey, const Options& options, const View* earlier = nullptr) {
  return simulated::grey(exported(even(grey), options, earlier), 9, 9);
}
int eight_bit(int grey, const Options& more = {}) {
  const View view = exported(even(grey), with(at("eight_bit", "mild"), more));
  EXPECT_EQ(view.image.pixels.type(), CV_8UC1);
  return view.image.pixels.at<std::uint8_t>(30, 30);
}

TEST(SimulateExport, NothingChangesWhenAllIsOff) {
  const View before = even(500), view = even(12345);
  EXPECT_TRUE(same(exported(view, {}), view));
  EXPECT_TRUE(same(exported(view, {}, &before), view));
  EXPECT_TRUE(same(exported(view, at("lag", "bad")), view)) << "no earlier image, no lag";
}

TEST(SimulateExport, LagMixesTheEarlierImage) {
  const View earlier = even(5000);
  EXPECT_EQ(exported_grey(1000, at("lag", "mild"), &earlier), 1200);   // 0.95 * 1000 + 0.05 * 5000
  EXPECT_EQ(exported_grey(1000, at("lag", "usual"), &earlier), 1600);  // 0.85 * 1000 + 0.15 * 5000
  EXPECT_EQ(exported_grey(1000, at("lag", "bad"), &earlier), 2400);    // 0.65 * 1000 + 0.35 * 5000
}

TEST(SimulateExport, EightBitsWithGamma) {
  EXPECT_EQ(eight_bit(65535), 255);
  EXPECT_EQ(eight_bit(0), 0);
  EXPECT_EQ(eight_bit(16384), 84);  // 255 * 0.25000^0.8 = 84.12
  EXPECT_EQ(eight_bit(6554), 40);   // 255 * 0.10001^0.8 = 40.42
  // Saturated first: (16384 - 0) / 50000 = 0.32768; 255 * 0.32768^0.8 = 104.44.
  EXPECT_EQ(eight_bit(16384, at("saturation", "mild")), 104);
  EXPECT_EQ(eight_bit(60000, at("saturation", "mild")), 255);
}

TEST(SimulateExport, SaturationCutsWhiteAndBlack) {
  EXPECT_EQ(exported_grey(40000, at("saturation", "usual")), 30000);
  EXPECT_EQ(exported_grey(12000, at("saturation", "usual")), 12000);
  EXPECT_EQ(exported_grey(900, at("saturation", "usual")), 1500);
}

TEST(SimulateExport, LocalContrastRaisesSmallDifferences) {
  View view = even(0, 128);
  view.image.pixels = image_of<std::uint16_t>(128, 128, [](int u, int) { return 11500 + 1000 * ((u / 4) % 2); });
  const auto contrast = [&](const std::string& level) {
    const cv::Mat pixels = exported(view, at("eight_bit", level)).image.pixels;
    return pixels.at<std::uint8_t>(64, 70) - pixels.at<std::uint8_t>(64, 66);
  };
  EXPECT_GT(std::abs(contrast("bad")), 1.3 * std::abs(contrast("mild")));
}

TEST(SimulateExport, TheCollimatorHasARimWithHalfShadow) {
  const Options usual = at("collimator", "usual");
  const View view = exported(even(20000, 256), usual);
  const auto grey = [&](int u) { return simulated::grey(view, u, 128); };
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
  EXPECT_TRUE(same(view, exported(even(20000, 256), usual)));
  EXPECT_FALSE(same(view, exported(even(20000, 256), with(usual, {{"collimator_seed", 2}}))));
}

TEST(SimulateExport, BadInputIsExplained) {
  EXPECT_EQ(refusal("simulate.export", {{"views", each_view(even_view("frontal", simulated::camera(0, 64), 7))}}),
            "simulate.export: view 'frontal' is not of 16 bits; give it the views of simulate.fluoroscopy");
  const auto refused = [&](const View& earlier) {
    return refusal("simulate.export", {{"views", each_view(even(100))}, {"earlier_views", each_view(earlier)}},
                   at("lag", "mild"));
  };
  EXPECT_EQ(refused(even(100, 64, "lateral")),
            "simulate.export: there is no earlier image of view 'frontal'; give 'earlier_views' the same views");
  EXPECT_EQ(refused(even(100, 32)), "simulate.export: the earlier image of view 'frontal' has another size");
}

const std::string kFaults = "simulate.camera_faults";
const Camera kExact = simulated::camera(30, 512);

View seen(const std::string& name = "frontal") {
  View view = even(100, 512, name);
  view.camera = kExact;
  return view;
}
Camera stated(int seed, const std::string& level) {
  static const Value views = each_view(seen());
  return output_list<View>(kFaults, "views", {{"views", views}}, {{"camera_seed", seed}, {"severity", level}})[0]
      .camera;
}

TEST(SimulateCameraFaults, HaveTheirRootMeanSquareAndALimit) {
  constexpr int kSeeds = 3000;
  for (const auto& [level, factor] : {std::pair("mild", 0.5), std::pair("usual", 1.0), std::pair("bad", 2.0)}) {
    std::array<double, 4> squares{}, largest{};
    for (int seed = 0; seed < kSeeds; ++seed) {
      const Camera found = stated(seed, level);
      check_camera(found, level);
      EXPECT_NEAR(found.intrinsics(1, 1) / found.intrinsics(0, 0), 1, 1e-12);
      const std::array<double, 4> errors{turn_between_deg(found.camera_from_world, kExact.camera_from_world),
                                         shift_between_mm(found.camera_from_world, kExact.camera_from_world),
                                         100 * (found.intrinsics(0, 0) / kExact.intrinsics(0, 0) - 1),
                                         (found.intrinsics - kExact.intrinsics).col(2).norm()};
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
  const Inputs two{{"views", each_view(seen("frontal"), seen("lateral"))}};
  const auto found = output_list<View>(kFaults, "views", two, {{"only", Strings{"lateral"}}});
  EXPECT_EQ(found[0].camera.camera_from_world.rotation, kExact.camera_from_world.rotation);
  EXPECT_EQ(found[0].camera.intrinsics, kExact.intrinsics);
  EXPECT_NE(found[1].camera.camera_from_world.rotation, kExact.camera_from_world.rotation);
  EXPECT_EQ(refusal(kFaults, two, {{"only", Strings{"lateal"}}}),
            "only: there is no view 'lateal'; did you mean 'lateral'?");
}

TEST(SimulateCameraFaults, OffLeavesTheCamera) {
  const Camera off = stated(5, "off");
  EXPECT_EQ(off.intrinsics, kExact.intrinsics);
  EXPECT_EQ(off.camera_from_world.rotation, kExact.camera_from_world.rotation);
  EXPECT_EQ(off.camera_from_world.translation_mm, kExact.camera_from_world.translation_mm);
  EXPECT_NE(stated(5, "mild").intrinsics, kExact.intrinsics);
  EXPECT_EQ(stated(5, "mild").intrinsics, stated(5, "mild").intrinsics);
}

}  // namespace marrow::test::export_test
