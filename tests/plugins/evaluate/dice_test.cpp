// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "shipped.hpp"

namespace dice_test {

using Eigen::Vector3d;

/// A box from `low` to `high` on a grid whose voxels begin at the origin.
marrow::SignedField box_field(const std::array<int, 3>& size, double spacing_mm, const Vector3d& low,
                              const Vector3d& high) {
  marrow::SignedField field;
  field.grid.size = size;
  field.grid.spacing_mm.setConstant(spacing_mm);
  field.grid.origin_mm.setConstant(0.5 * spacing_mm);
  for (int z = 0; z < size[2]; ++z)
    for (int y = 0; y < size[1]; ++y)
      for (int x = 0; x < size[0]; ++x) {
        const Vector3d p = field.grid.point_from_index({double(x), double(y), double(z)});
        field.values_mm.push_back(float((low - p).cwiseMax(p - high).maxCoeff()));
      }
  return field;
}

marrow::Value dice(const marrow::SignedField& field, const marrow::SignedField& reference) {
  return shipped::call("evaluate.dice", {{"field", shipped::item(field)}, {"reference", shipped::item(reference)}})
      .at("metrics");
}

TEST(Dice, OfShiftedBoxes) {
  // 8 x 6 x 6 voxels each, 6 x 6 x 6 in common: 2 * 216 / (288 + 288), 216 / 360.
  const auto metrics =
      dice(box_field({16, 10, 10}, 1, {2, 2, 2}, {10, 8, 8}), box_field({16, 10, 10}, 1, {4, 2, 2}, {12, 8, 8}));
  EXPECT_NEAR(shipped::figure(metrics, "dice"), 0.75, 1e-12);
  EXPECT_NEAR(shipped::figure(metrics, "jaccard"), 0.6, 1e-12);
  EXPECT_NEAR(shipped::figure(metrics, "volume_mm3"), 288, 1e-9);
  EXPECT_NEAR(shipped::figure(metrics, "reference_mm3"), 288, 1e-9);
}

TEST(Dice, IsOneOfTheSameAndZeroOfApart) {
  const auto box = box_field({16, 10, 10}, 1, {2, 2, 2}, {10, 8, 8});
  EXPECT_EQ(shipped::figure(dice(box, box), "dice"), 1);
  EXPECT_EQ(shipped::figure(dice(box, box_field({16, 10, 10}, 1, {11, 2, 2}, {14, 8, 8})), "dice"), 0);
}

TEST(Dice, OnAnotherGrid) {
  // The same box in voxels of half the size, and on a larger grid: each voxel of the first finds it where it is.
  const auto coarse = box_field({16, 10, 10}, 1, {2, 2, 2}, {10, 8, 8});
  EXPECT_NEAR(shipped::figure(dice(coarse, box_field({40, 20, 20}, 0.5, {2, 2, 2}, {10, 8, 8})), "dice"), 1, 1e-12);
  EXPECT_NEAR(shipped::figure(dice(box_field({40, 20, 20}, 0.5, {2, 2, 2}, {10, 8, 8}), coarse), "dice"), 1, 0.002)
      << "of coarse samples, the corners are rounded";
}

TEST(Dice, WhatTheGridDoesNotShowCountsAsMissed) {
  // The first grid ends at x = 8: 6 x 6 x 6 voxels of it are inside; the reference has 2 x 6 x 6 more beyond.
  const auto metrics =
      dice(box_field({8, 10, 10}, 1, {2, 2, 2}, {10, 8, 8}), box_field({16, 10, 10}, 1, {2, 2, 2}, {10, 8, 8}));
  EXPECT_NEAR(shipped::figure(metrics, "volume_mm3"), 216, 1e-9);
  EXPECT_NEAR(shipped::figure(metrics, "reference_mm3"), 288, 1e-9);
  EXPECT_NEAR(shipped::figure(metrics, "dice"), 2 * 216.0 / (216 + 288), 1e-12);
}

TEST(Dice, SaysWhatIsWrong) {
  const auto box = box_field({8, 8, 8}, 1, {2, 2, 2}, {6, 6, 6}),
             none = box_field({8, 8, 8}, 1, {20, 2, 2}, {26, 6, 6});
  const auto refusal = [](const marrow::SignedField& field, const marrow::SignedField& reference) {
    return shipped::refusal("evaluate.dice",
                            {{"field", shipped::item(field)}, {"reference", shipped::item(reference)}});
  };
  EXPECT_EQ(refusal(none, none),
            "neither the field nor the reference has an inside, so there is nothing to compare; inside is where values "
            "are negative");
  auto other = box;
  other.grid.frame = "mri";
  EXPECT_EQ(refusal(box, other),
            "the field is in the frame 'ct', but the reference in 'mri'; compare segmentations of the same CT");
  other = box;
  other.values_mm.pop_back();
  EXPECT_EQ(refusal(other, box), "field: 512 voxels expected from its size, got 511");
}

}  // namespace dice_test
