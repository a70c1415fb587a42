// SPDX-License-Identifier: Apache-2.0
#include "plugins/simulate/fluoroscopy.cpp"

#include "tests/plugins/simulate/phantoms.hpp"

namespace marrow::test::fluoroscopy_test {

using namespace simulated;

FluoroscopyOptions ideal() { return {.photons = 0, .blur_px = 0, .scatter_to_primary = 0, .scatter_px = 70}; }

View exposed(const Phantom& phantom, const FluoroscopyOptions& options = ideal(), std::uint64_t seed = 1,
             int size_px = 128) {
  Context context(seed);
  return fluoroscopy(phantom, named("frontal", simulated::camera(0, size_px)), nullptr, options, context)[0];
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
  Phantom phantom = whole(box_between({-30, -4, -30}, {30, 6, 30}));
  const View view = exposed(phantom);
  // No thigh: air is 12000. The ray through pixel (70, 60) crosses 10 mm at a slant.
  const Vector3d direction = ray_direction(view.camera, {70, 60});
  EXPECT_NEAR(grey(view, 70, 60), 12000 * transmission({10 / direction.y(), 0, 0, 0}), 1.5);
  EXPECT_EQ(grey(view, 2, 2), 12000);
  EXPECT_EQ(view.image.pixels.type(), CV_16UC1);
}

TEST(SimulateFluoroscopy, MarrowAndMuscleFillTheRest) {
  Phantom phantom =
      whole(box_between({-30, -20, -30}, {30, 20, 30}), box_between({-25, -15, -25}, {25, 15, 25}), 80, 10);
  phantom.bone.fill_z_mm = {0};
  phantom.bone.fill_fraction = {0.2};
  const Camera view_camera = simulated::camera(0, 129);
  const ClutteredPhantom cluttered{phantom, {}, {}};
  const XRay xray(cluttered, view_camera);
  cv::Mat1d primary(129, 129, 0.0);
  xray.render(0, 129, primary);
  // The pixel in the middle: 10 mm cortex, 30 mm filling, 140 - 40 mm muscle, 20 mm fat, to a slant of a quarter pixel.
  EXPECT_NEAR(primary(64, 64) / transmission({10 + 0.2 * 30, 0.8 * 30, 100, 20}), 1, 1e-3);
}

TEST(SimulateFluoroscopy, TwoSidesOfAFractureAddUpToTheWholeBone) {
  Phantom phantom = whole(upright_cylinder(14, -60, 60), upright_cylinder(7, -50, 50));
  phantom.fracture = box_between({-40, -40, -90}, {40, 40, 40});
  const auto bone_lengths = [&](int side) {
    phantom.fragments[0].side = side;
    const Camera view_camera = simulated::camera(30, 128);
    const ClutteredPhantom cluttered{phantom, {}, {}};
    const XRay xray(cluttered, view_camera);
    Numbers result(256 * 256, 0.0);
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
  const Vector3d landmark(22, -14, 31);
  Phantom phantom = whole(sphere(landmark, 3, 0.4));
  phantom.fragments[0].ct_from_bone.translation_mm = {0, 0, -2};
  phantom.fragments[0].world_from_ct = placed({7, 9, -11}, {0.2, 0.4, -0.9});
  const View view = exposed(phantom, ideal(), 1, 512);
  double weight = 0;
  Vector2d centre = Vector2d::Zero();
  for (int v = 0; v < 512; ++v)
    for (int u = 0; u < 512; ++u) {
      const double dark = 12000 - grey(view, u, v);
      weight += dark;
      centre += dark * Vector2d(u, v);
    }
  const Vector3d in_ct = landmark + Vector3d(0, 0, -2);
  const Vector2d expected = project(view.camera, phantom.fragments[0].world_from_ct * in_ct);
  EXPECT_NEAR((centre / weight - expected).norm(), 0, 0.02);
}

TEST(SimulateFluoroscopy, NoiseIsPoissonAndDependsOnTheSeedAlone) {
  const Phantom phantom = whole(box_between({-10, -4, -10}, {10, 6, 10}));
  const FluoroscopyOptions options{.photons = 2000, .blur_px = 0, .scatter_to_primary = 0, .scatter_px = 70};
  const auto image = [&](std::uint64_t seed, std::size_t threads) {
    return with_threads(threads, [&] { return exposed(phantom, options, seed, 256); });
  };
  const View one = image(3, 1);
  EXPECT_TRUE(same(one, image(3, 4)));
  EXPECT_FALSE(same(one, image(4, 4)));
  double sum = 0, squares = 0;  // the upper rows are air
  const int count = 60 * 256;
  for (int i = 0; i < count; ++i) {
    const double value = grey(one, i % 256, i / 256);
    sum += value;
    squares += value * value;
  }
  const double mean = sum / count, spread = std::sqrt(squares / count - mean * mean);
  EXPECT_NEAR(mean, 12000, 12);
  EXPECT_NEAR(spread / 12000, 1 / std::sqrt(2000.0), 0.0008);
}

TEST(SimulateFluoroscopy, ScatterVeilsBone) {
  const Phantom phantom = whole(box_between({-15, -10, -200}, {15, 10, 200}), {}, 80, 10);
  FluoroscopyOptions options = ideal();
  const auto contrast = [](const View& view) { return grey(view, 84, 64) / double(grey(view, 64, 64)); };
  const double clear = contrast(exposed(phantom, options));
  options.scatter_to_primary = 0.5;
  const double veiled = contrast(exposed(phantom, options));
  EXPECT_GT(clear, 2);
  EXPECT_LT(veiled, 0.85 * clear);
  EXPECT_GT(veiled, 1.2);
}

TEST(SimulateFluoroscopy, BlurWidensAnEdgeByItsSpread) {
  Phantom phantom = whole(box_between({0, -2, -200}, {400, 2, 200}));
  FluoroscopyOptions options = ideal();
  options.blur_px = 2;
  const View view = exposed(phantom, options, 1, 129);
  const auto at = [&](int u) { return double(grey(view, u, 64)); };
  // The edge lies at the middle of pixel 64: between its neighbours at +-2 px the Gaussian step changes by erf(1 / sqrt
  // 2).
  EXPECT_NEAR((at(62) - at(66)) / (at(20) - at(100)), std::erf(1 / std::sqrt(2.0)), 0.03);
}

TEST(SimulateFluoroscopy, BadInputIsExplained) {
  Phantom phantom = whole(box_between({-10, -4, -10}, {10, 6, 10}));
  phantom.fragments[0].world_from_ct.translation_mm = {0, -600, 0};
  EXPECT_EQ(MESSAGE_OF(exposed(phantom)),
            "simulate.fluoroscopy: fragment 'whole' reaches to -4.000000 mm from the X-ray source; it must lie in "
            "front of the source, so check the camera's distances and the fragment's translation");
  phantom = whole(box_between({-10, -4, -10}, {10, 6, 10}));
  phantom.fragments[0].world_from_ct.rotation *= 2;
  EXPECT_NE(MESSAGE_OF(exposed(phantom)), "");
}

}  // namespace marrow::test::fluoroscopy_test
