// SPDX-License-Identifier: Apache-2.0
#include "plugins/simulate/ct.cpp"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "shapes.hpp"

namespace {

namespace test = phantom::test;

Phantom tube() {
  Phantom phantom = test::whole(test::cylinder(14, 0, 60), test::cylinder(7, 5, 55));
  phantom.bone.fill_z_mm = {0, 20, 30, 60};
  phantom.bone.fill_fraction = {0.25, 0.25, 0, 0};
  phantom.bone.thigh_radius_mm = 24;
  phantom.bone.fat_mm = 5;
  return phantom;
}

float at(const Volume& volume, const Eigen::Vector3d& point) {
  return sample_trilinear(volume.grid, volume.values, volume.grid.index_from_point(point));
}

TEST(SimulateCt, MaterialsHaveTheirHounsfieldUnits) {
  CtOptions options;
  options.noise_hu = 0;
  Context context;
  const Volume volume = scan(tube(), options, context);
  EXPECT_NEAR(at(volume, {10.5, 0, 30}), 1450, 1);
  EXPECT_NEAR(at(volume, {0, -10.5, 30}), 1450, 1);
  EXPECT_NEAR(at(volume, {0, 0, 45}), -20, 1);
  EXPECT_NEAR(at(volume, {0, 0, 12}), 0.25 * 1450 - 0.75 * 20, 1);
  EXPECT_NEAR(at(volume, {16.5, 0, 30}), 50, 1);
  EXPECT_NEAR(at(volume, {0, 21.5, 30}), -100, 1);
  EXPECT_NEAR(at(volume, {20, 20, 30}), -1000, 1);
  EXPECT_EQ(volume.grid.spacing_mm, Eigen::Vector3d(0.8, 0.8, 1.0));
  EXPECT_EQ(volume.grid.frame, "ct");
}

TEST(SimulateCt, EdgesAreAGaussianStepAlongEachAxis) {
  // The faces of a cube lie at 0; a Gaussian point-spread function turns a step into its cumulative distribution. Along
  // x lengths are exact; along y and z a face lies halfway between the last ray outside and the first one inside, at
  // most 0.15 mm off.
  Phantom phantom = test::whole(test::box({0, 0, 0}, {30, 30, 30}));
  CtOptions options;
  options.noise_hu = 0;
  options.blur_mm = 0.9;
  options.margin_mm = 6.3;
  Context context;
  const Volume volume = scan(phantom, options, context);
  const Raster raster = raster_under(volume.grid, options.blur_mm);
  for (int axis = 0; axis < 3; ++axis) {
    const Eigen::Vector3d point(15, 15, 15);
    const double fine = raster.spacing_mm[axis];
    const double face =
        axis == 0 ? 0 : raster.origin_mm[axis] + (std::ceil(-raster.origin_mm[axis] / fine) - 0.5) * fine;
    EXPECT_LE(std::abs(face), 0.15);
    for (int i = 0; i < 20; ++i) {
      Eigen::Vector3d index = volume.grid.index_from_point(point);
      index[0] = std::round(index[0]), index[1] = std::round(index[1]), index[2] = std::round(index[2]);
      index[axis] = i;
      const double distance = volume.grid.point_from_index(index)[axis];
      const double expected = -1000 + 2450 * 0.5 * std::erfc(-(distance - face) / (0.9 * std::sqrt(2.0)));
      EXPECT_NEAR(volume.at(int(index[0]), int(index[1]), int(index[2])), expected, 6)
          << "axis " << axis << " at " << distance;
    }
  }
}

TEST(SimulateCt, NoiseHasItsSpreadAndDependsOnTheSeedAlone) {
  CtOptions options;
  const auto scanned = [&](std::uint64_t seed, std::size_t threads) {
    tbb::global_control control(tbb::global_control::max_allowed_parallelism, threads);
    Context context(seed);
    return scan(tube(), options, context).values;
  };
  const auto one = scanned(5, 1);
  EXPECT_EQ(one, scanned(5, 4));
  EXPECT_NE(one, scanned(6, 4));
  options.noise_hu = 0;
  const auto clean = scanned(5, 4);
  double sum = 0, squares = 0;
  for (std::size_t i = 0; i < one.size(); ++i) {
    sum += one[i] - clean[i];
    squares += std::pow(one[i] - clean[i], 2);
  }
  EXPECT_NEAR(sum / double(one.size()), 0, 0.5);
  EXPECT_NEAR(std::sqrt(squares / double(one.size())), 30, 0.5);
}

TEST(SimulateCt, RangeCoversOnlyPartOfTheBone) {
  CtOptions options;
  options.range_mm = {20, 45};
  Context context;
  const Volume volume = scan(tube(), options, context);
  EXPECT_NEAR(volume.grid.origin_mm.z(), 20, 1e-9);
  EXPECT_EQ(volume.grid.size[2], 26);
  options.noise_hu = 0;
  const Volume part = scan(tube(), options, context);
  options.range_mm = {0, 0};
  const Volume all = scan(tube(), options, context);
  EXPECT_EQ(part.at(20, 20, 10), all.at(20, 20, 10 + 32));  // the whole CT begins 12 mm below the bone
}

TEST(SimulateCt, FragmentsLieWhereTheCtHasThem) {
  Phantom phantom = test::whole(test::box({0, 0, 0}, {10, 10, 10}));
  phantom.fragments[0].ct_from_bone.translation_mm = {100, 0, 0};
  CtOptions options;
  options.noise_hu = 0;
  Context context;
  const Volume volume = scan(phantom, options, context);
  EXPECT_NEAR(at(volume, {105, 5, 5}), 1450, 1);
  EXPECT_LT(volume.grid.point_from_index({0, 0, 0}).x(), 100);
  EXPECT_GT(volume.grid.point_from_index({0, 0, 0}).x(), 80);
}

TEST(SimulateCt, BadInputIsExplained) {
  Context context;
  CtOptions options;
  Phantom open = tube();
  open.bone.outer.triangles.pop_back();
  EXPECT_EQ(test::message_of([&] { scan(open, options, context); }),
            "simulate.ct, outer surface: the surface is open or not consistently oriented, so it has no inside; close "
            "its holes "
            "(each edge must be shared by exactly two triangles)");
  options.range_mm = {100, 200};
  EXPECT_EQ(test::message_of([&] { scan(tube(), options, context); }),
            "simulate.ct: range_mm 100.000000 to 200.000000 (from the distal end) holds no part of the bone");
  options.range_mm = {0, 0};
  options.spacing_mm[1] = 0;
  EXPECT_EQ(test::message_of([&] { scan(tube(), options, context); }),
            "simulate.ct: spacing_mm must be positive, got 0.000000");
  EXPECT_EQ(test::message_of([&] {
              scan(Phantom{tube().bone, {}, {}}, CtOptions{}, context);
            }),
            "simulate.ct: the phantom has no fragments; break the bone first");
}

}  // namespace
