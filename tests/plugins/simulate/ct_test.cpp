// SPDX-License-Identifier: Apache-2.0
#include "tests/plugins/simulate/phantoms.hpp"

namespace marrow::test::ct_test {

using namespace simulated;

Phantom tube() {
  Phantom phantom = whole(upright_cylinder(14, 0, 60), upright_cylinder(7, 5, 55), 24, 5);
  phantom.bone.fill_z_mm = {0, 20, 30, 60};
  phantom.bone.fill_fraction = {0.25, 0.25, 0, 0};
  return phantom;
}

TEST(SimulateCt, MaterialsHaveTheirHounsfieldUnits) {
  const Volume volume = ct(tube(), {{"noise_hu", 0.0}});
  for (const auto& [point_mm, hu] : std::vector<std::pair<Vector3d, double>>{{{10.5, 0, 30}, 1450},
                                                                             {{0, -10.5, 30}, 1450},
                                                                             {{0, 0, 45}, -20},
                                                                             {{0, 0, 12}, 0.25 * 1450 - 0.75 * 20},
                                                                             {{16.5, 0, 30}, 50},
                                                                             {{0, 21.5, 30}, -100},
                                                                             {{20, 20, 30}, -1000}})
    EXPECT_NEAR(value_at(volume, point_mm), hu, 1) << point_mm.transpose();
  EXPECT_EQ(volume.grid.spacing_mm, Vector3d(0.8, 0.8, 1.0));
  EXPECT_EQ(volume.grid.frame, "ct");
}

TEST(SimulateCt, EdgesAreAGaussianStepAlongEachAxis) {
  // The faces of a cube lie at 0; a Gaussian point-spread function turns a step into its cumulative distribution. Along
  // x lengths are exact; along y and z a face lies halfway between the last ray outside and the first one inside, at
  // most 0.15 mm off.
  const Volume volume =
      ct(whole(box_between({0, 0, 0}, {30, 30, 30})), {{"noise_hu", 0.0}, {"blur_mm", 0.9}, {"margin_mm", 6.3}});
  for (int axis = 0; axis < 3; ++axis) {
    // The rays through the voxels' centres and, at most 0.3 mm apart, between them.
    const double low = volume.grid.origin_mm[axis], spacing = volume.grid.spacing_mm[axis];
    const double fine = spacing / std::ceil(spacing / 0.3);
    const double face = axis == 0 ? 0 : low + (std::ceil(-low / fine) - 0.5) * fine;
    EXPECT_LE(std::abs(face), 0.15);
    for (int i = 0; i < 20; ++i) {
      Vector3d index = volume.grid.index_from_point({15, 15, 15}).array().round();
      index[axis] = i;
      const double distance = volume.grid.point_from_index(index)[axis];
      const double expected = -1000 + 2450 * 0.5 * std::erfc(-(distance - face) / (0.9 * std::sqrt(2.0)));
      EXPECT_NEAR(volume.at(int(index[0]), int(index[1]), int(index[2])), expected, 6)
          << "axis " << axis << " at " << distance;
    }
  }
}

TEST(SimulateCt, NoiseHasItsSpreadAndDependsOnTheSeedAlone) {
  const auto scanned = [](std::uint64_t seed, std::size_t threads, const Options& options = {}) {
    return with_threads(threads, [&] { return ct(tube(), options, seed).values; });
  };
  const auto one = scanned(5, 1), clean = scanned(5, 4, {{"noise_hu", 0.0}});
  EXPECT_EQ(one, scanned(5, 4));
  EXPECT_NE(one, scanned(6, 4));
  double sum = 0, squares = 0;
  for (std::size_t i = 0; i < one.size(); ++i) {
    sum += one[i] - clean[i];
    squares += std::pow(one[i] - clean[i], 2);
  }
  EXPECT_NEAR(sum / double(one.size()), 0, 0.5);
  EXPECT_NEAR(std::sqrt(squares / double(one.size())), 30, 0.5);
}

TEST(SimulateCt, RangeCoversOnlyPartOfTheBone) {
  const auto scanned = [](double from_mm, double to_mm) {
    return ct(tube(), {{"range_mm", Numbers{from_mm, to_mm}}, {"noise_hu", 0.0}});
  };
  const Volume part = scanned(20, 45);
  EXPECT_NEAR(part.grid.origin_mm.z(), 20, 1e-9);
  EXPECT_EQ(part.grid.size[2], 26);
  EXPECT_EQ(part.at(20, 20, 10), scanned(0, 0).at(20, 20, 10 + 32));  // the whole CT begins 12 mm below the bone
}

TEST(SimulateCt, FragmentsLieWhereTheCtHasThem) {
  Phantom phantom = whole(box_between({0, 0, 0}, {10, 10, 10}));
  phantom.fragments[0].ct_from_bone.translation_mm = {100, 0, 0};
  const Volume volume = ct(phantom, {{"noise_hu", 0.0}});
  EXPECT_NEAR(value_at(volume, {105, 5, 5}), 1450, 1);
  EXPECT_LT(volume.grid.point_from_index({0, 0, 0}).x(), 100);
  EXPECT_GT(volume.grid.point_from_index({0, 0, 0}).x(), 80);
}

TEST(SimulateCt, BadInputIsExplained) {
  const auto refused = [](const Phantom& phantom, const Options& options = {}) {
    return refusal("simulate.ct", {{"phantom", item(phantom)}}, options);
  };
  Phantom open = tube();
  open.bone.outer = opened(open.bone.outer);
  EXPECT_EQ(refused(open),
            "simulate.ct, outer surface: the surface is open or not consistently oriented, so it has no inside; close "
            "its holes (each edge must be shared by exactly two triangles)");
  EXPECT_EQ(refused(tube(), {{"range_mm", Numbers{100, 200}}}),
            "simulate.ct: range_mm 100.000000 to 200.000000 (from the distal end) holds no part of the bone");
  EXPECT_EQ(refused(tube(), {{"spacing_mm", Numbers{0.8, 0, 1.0}}}),
            "simulate.ct: spacing_mm must be positive, got 0.000000");
  EXPECT_EQ(refused({tube().bone, {}, {}}), "simulate.ct: the phantom has no fragments; break the bone first");
}

}  // namespace marrow::test::ct_test
