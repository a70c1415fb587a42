// SPDX-License-Identifier: Apache-2.0
#include "plugins/simulate/fluoroscopy.cpp"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "shapes.hpp"

namespace {

namespace test = phantom::test;

FluoroscopyOptions ideal() { return {.photons = 0, .blur_px = 0, .scatter_to_primary = 0, .scatter_px = 70}; }

View exposed(const Phantom& phantom, const FluoroscopyOptions& options, std::uint64_t seed = 1, int size_px = 128) {
  List<Camera> cameras;
  cameras.add("frontal", test::camera(0, size_px));
  Context context(seed);
  return fluoroscopy(phantom, cameras, nullptr, options, context)[0];
}

TEST(SimulateFluoroscopy, TransmissionIsBeersLawOverTheSpectrum) {
  EXPECT_NEAR(transmission({}), 1, 1e-12);
  const double expected = 0.40 * std::exp(-0.1235 * 10 - 0.0284 * 50) + 0.33 * std::exp(-0.07937 * 10 - 0.0239 * 50) +
                          0.20 * std::exp(-0.05934 * 10 - 0.02161 * 50) + 0.07 * std::exp(-0.04871 * 10 - 0.0202 * 50);
  EXPECT_NEAR(transmission({10, 0, 50, 0}), expected, 1e-12);
  // Beam hardening: the second centimetre of bone stops a smaller share than the first.
  EXPECT_GT(transmission({20, 0, 0, 0}) / transmission({10, 0, 0, 0}), transmission({10, 0, 0, 0}));
}

TEST(SimulateFluoroscopy, GreyBehindASlabIsItsTransmission) {
  Phantom phantom = test::whole(test::box({-30, -4, -30}, {30, 6, 30}));
  const View view = exposed(phantom, ideal());
  // No thigh: air is 12000. The ray through pixel (70, 60) crosses 10 mm at a slant.
  const Eigen::Vector3d direction = ray_direction(view.camera, {70, 60});
  EXPECT_NEAR(view.image.pixels.at<std::uint16_t>(60, 70), 12000 * transmission({10 / direction.y(), 0, 0, 0}), 1.5);
  EXPECT_EQ(view.image.pixels.at<std::uint16_t>(2, 2), 12000);
  EXPECT_EQ(view.image.pixels.type(), CV_16UC1);
}

TEST(SimulateFluoroscopy, MarrowAndMuscleFillTheRest) {
  Phantom phantom = test::whole(test::box({-30, -20, -30}, {30, 20, 30}), test::box({-25, -15, -25}, {25, 15, 25}));
  phantom.bone.fill_z_mm = {0};
  phantom.bone.fill_fraction = {0.2};
  phantom.bone.thigh_radius_mm = 80;
  phantom.bone.fat_mm = 10;
  const Camera camera = test::camera(0, 129);
  const ClutteredPhantom cluttered{phantom, {}, {}};
  const XRay xray(cluttered, camera);
  cv::Mat1d primary(129, 129, 0.0);
  xray.render(0, 129, primary);
  // The pixel in the middle: 10 mm cortex, 30 mm filling, 140 - 40 mm muscle, 20 mm fat, to a slant of a quarter pixel.
  EXPECT_NEAR(primary(64, 64) / transmission({10 + 0.2 * 30, 0.8 * 30, 100, 20}), 1, 1e-3);
}

TEST(SimulateFluoroscopy, TwoSidesOfAFractureAddUpToTheWholeBone) {
  Phantom phantom = test::whole(test::cylinder(14, -60, 60), test::cylinder(7, -50, 50));
  phantom.fracture = test::box({-40, -40, -90}, {40, 40, 40});
  const auto bone_lengths = [&](int side) {
    phantom.fragments[0].side = side;
    const Camera camera = test::camera(30, 128);
    const ClutteredPhantom cluttered{phantom, {}, {}};
    const XRay xray(cluttered, camera);
    std::vector<double> result(256 * 256, 0.0);
    std::vector<Interval> intervals;
    const auto crossings = xray.rays().bundle().crossings(0, 256);
    phantom::for_each_ray(crossings, [&](std::span<const phantom::Crossing> ray) {
      xray.rays().intervals(ray, intervals);
      Lengths lengths;
      xray.add_bone(xray.ray(int(ray[0].column), int(ray[0].row)), intervals, lengths);
      result[ray[0].row * 256 + ray[0].column] = lengths.bone;
    });
    return result;
  };
  const auto whole = bone_lengths(0), below = bone_lengths(-1), above = bone_lengths(1);
  double total = 0;
  for (std::size_t i = 0; i < whole.size(); ++i) {
    EXPECT_NEAR(whole[i], below[i] + above[i], 1e-9);
    total += std::min(below[i], above[i]);
  }
  EXPECT_GT(total, 0);  // some rays cross both sides
}

TEST(SimulateFluoroscopy, TheTruthMapsALandmarkToWhereTheImageShowsIt) {
  // A ball 3 mm wide, far from the fragment's origin, moved by a large known transform.
  const Eigen::Vector3d landmark(22, -14, 31);
  Phantom phantom = test::whole(test::sphere(landmark, 3, 0.4));
  phantom.fragments[0].ct_from_bone.translation_mm = {0, 0, -2};
  phantom.fragments[0].world_from_ct.rotation = rotation_from_vector({0.2, 0.4, -0.9});
  phantom.fragments[0].world_from_ct.translation_mm = {7, 9, -11};
  const View view = exposed(phantom, ideal(), 1, 512);
  double weight = 0;
  Eigen::Vector2d centre = Eigen::Vector2d::Zero();
  for (int v = 0; v < 512; ++v)
    for (int u = 0; u < 512; ++u) {
      const double dark = 12000 - view.image.pixels.at<std::uint16_t>(v, u);
      weight += dark;
      centre += dark * Eigen::Vector2d(u, v);
    }
  const Eigen::Vector3d in_ct = landmark + Eigen::Vector3d(0, 0, -2);
  const Eigen::Vector2d expected = project(view.camera, phantom.fragments[0].world_from_ct * in_ct);
  EXPECT_NEAR((centre / weight - expected).norm(), 0, 0.02);
}

TEST(SimulateFluoroscopy, NoiseIsPoissonAndDependsOnTheSeedAlone) {
  Phantom phantom = test::whole(test::box({-10, -4, -10}, {10, 6, 10}));
  FluoroscopyOptions options = ideal();
  options.photons = 2000;
  const auto pixels = [&](std::uint64_t seed, std::size_t threads) {
    tbb::global_control control(tbb::global_control::max_allowed_parallelism, threads);
    const View view = exposed(phantom, options, seed, 256);
    return std::vector<std::uint16_t>(view.image.pixels.begin<std::uint16_t>(), view.image.pixels.end<std::uint16_t>());
  };
  const auto one = pixels(3, 1);
  EXPECT_EQ(one, pixels(3, 4));
  EXPECT_NE(one, pixels(4, 4));
  double sum = 0, squares = 0;  // the upper rows are air
  const int count = 60 * 256;
  for (int i = 0; i < count; ++i) {
    sum += one[std::size_t(i)];
    squares += double(one[std::size_t(i)]) * one[std::size_t(i)];
  }
  const double mean = sum / count, spread = std::sqrt(squares / count - mean * mean);
  EXPECT_NEAR(mean, 12000, 12);
  EXPECT_NEAR(spread / 12000, 1 / std::sqrt(2000.0), 0.0008);
}

TEST(SimulateFluoroscopy, ScatterVeilsBone) {
  Phantom phantom = test::whole(test::box({-15, -10, -200}, {15, 10, 200}));
  phantom.bone.thigh_radius_mm = 80;
  phantom.bone.fat_mm = 10;
  FluoroscopyOptions options = ideal();
  const auto contrast = [](const View& view) {
    return view.image.pixels.at<std::uint16_t>(64, 84) / double(view.image.pixels.at<std::uint16_t>(64, 64));
  };
  const double clear = contrast(exposed(phantom, options));
  options.scatter_to_primary = 0.5;
  const double veiled = contrast(exposed(phantom, options));
  EXPECT_GT(clear, 2);
  EXPECT_LT(veiled, 0.85 * clear);
  EXPECT_GT(veiled, 1.2);
}

TEST(SimulateFluoroscopy, BlurWidensAnEdgeByItsSpread) {
  Phantom phantom = test::whole(test::box({0, -2, -200}, {400, 2, 200}));
  FluoroscopyOptions options = ideal();
  options.blur_px = 2;
  const View view = exposed(phantom, options, 1, 129);
  const auto grey = [&](int u) { return double(view.image.pixels.at<std::uint16_t>(64, u)); };
  const double air = grey(20), bone = grey(100);
  // The edge lies at the middle of pixel 64: between its neighbours at +-2 px the Gaussian step changes by erf(1 / sqrt
  // 2).
  EXPECT_NEAR((grey(62) - grey(66)) / (air - bone), std::erf(1 / std::sqrt(2.0)), 0.03);
}

TEST(SimulateFluoroscopy, BadInputIsExplained) {
  Phantom phantom = test::whole(test::box({-10, -4, -10}, {10, 6, 10}));
  phantom.fragments[0].world_from_ct.translation_mm = {0, -600, 0};
  const std::string message = marrow::test::message_of([&] { exposed(phantom, ideal()); });
  EXPECT_EQ(message,
            "simulate.fluoroscopy: fragment 'whole' reaches to -4.000000 mm from the X-ray source; it must lie in "
            "front of the "
            "source, so check the camera's distances and the fragment's translation");
  phantom = test::whole(test::box({-10, -4, -10}, {10, 6, 10}));
  phantom.fragments[0].world_from_ct.rotation *= 2;
  EXPECT_NE(marrow::test::message_of([&] { exposed(phantom, ideal()); }), "");
}

}  // namespace
