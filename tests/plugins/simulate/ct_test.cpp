// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "nodes.hpp"
#include "shapes.hpp"

namespace ct_test {

using namespace marrow;
using phantom::Phantom;
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
  const Volume volume = simulated::ct(tube(), {{"noise_hu", 0.0}});
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
  const Volume volume = simulated::ct(phantom, {{"noise_hu", 0.0}, {"blur_mm", 0.9}, {"margin_mm", 6.3}});
  for (int axis = 0; axis < 3; ++axis) {
    const Eigen::Vector3d point(15, 15, 15);
    // The rays through the voxels' centres and, at most 0.3 mm apart, between them.
    const double low = volume.grid.origin_mm[axis], spacing = volume.grid.spacing_mm[axis];
    const double fine = spacing / std::ceil(spacing / 0.3);
    const double face = axis == 0 ? 0 : low + (std::ceil(-low / fine) - 0.5) * fine;
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
  shipped::Options options;
  const auto scanned = [&](std::uint64_t seed, std::size_t threads) {
    tbb::global_control control(tbb::global_control::max_allowed_parallelism, threads);
    return simulated::ct(tube(), options, seed).values;
  };
  const auto one = scanned(5, 1);
  EXPECT_EQ(one, scanned(5, 4));
  EXPECT_NE(one, scanned(6, 4));
  options["noise_hu"] = 0.0;
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
  shipped::Options options{{"range_mm", std::vector<double>{20, 45}}};
  const Volume volume = simulated::ct(tube(), options);
  EXPECT_NEAR(volume.grid.origin_mm.z(), 20, 1e-9);
  EXPECT_EQ(volume.grid.size[2], 26);
  options["noise_hu"] = 0.0;
  const Volume part = simulated::ct(tube(), options);
  options["range_mm"] = std::vector<double>{0, 0};
  const Volume all = simulated::ct(tube(), options);
  EXPECT_EQ(part.at(20, 20, 10), all.at(20, 20, 10 + 32));  // the whole CT begins 12 mm below the bone
}

TEST(SimulateCt, FragmentsLieWhereTheCtHasThem) {
  Phantom phantom = test::whole(test::box({0, 0, 0}, {10, 10, 10}));
  phantom.fragments[0].ct_from_bone.translation_mm = {100, 0, 0};
  const Volume volume = simulated::ct(phantom, {{"noise_hu", 0.0}});
  EXPECT_NEAR(at(volume, {105, 5, 5}), 1450, 1);
  EXPECT_LT(volume.grid.point_from_index({0, 0, 0}).x(), 100);
  EXPECT_GT(volume.grid.point_from_index({0, 0, 0}).x(), 80);
}

TEST(SimulateCt, BadInputIsExplained) {
  Phantom open = tube();
  open.bone.outer.triangles.pop_back();
  EXPECT_EQ(marrow::test::message_of([&] { simulated::ct(open, {}); }),
            "simulate.ct, outer surface: the surface is open or not consistently oriented, so it has no inside; close "
            "its holes "
            "(each edge must be shared by exactly two triangles)");
  EXPECT_EQ(marrow::test::message_of([] {
              simulated::ct(tube(), {{"range_mm", std::vector<double>{100, 200}}});
            }),
            "simulate.ct: range_mm 100.000000 to 200.000000 (from the distal end) holds no part of the bone");
  EXPECT_EQ(marrow::test::message_of([] {
              simulated::ct(tube(), {{"spacing_mm", std::vector<double>{0.8, 0, 1.0}}});
            }),
            "simulate.ct: spacing_mm must be positive, got 0.000000");
  EXPECT_EQ(marrow::test::message_of([] {
              simulated::ct(Phantom{tube().bone, {}, {}}, {});
            }),
            "simulate.ct: the phantom has no fragments; break the bone first");
}

}  // namespace ct_test
