// SPDX-License-Identifier: Apache-2.0
#include "plugins/initial/manual.cpp"

#include <gtest/gtest.h>

#include "initial/tube.hpp"

namespace {

TEST(Manual, MovesAboutTheFragmentsOwnAxes) {
  const marrow::Mesh model = tube::mesh(
      90, [](double, double) { return 14.0; }, [](double) { return Eigen::Vector3d(30, 0, 0); });
  Options options;
  options.rotation_deg = {0, 0, 90};
  options.translation_mm = {1, 2, 3};
  const marrow::Pose pose = manual(model, nullptr, options);
  EXPECT_LT((pose.frame.origin_mm - Eigen::Vector3d(30, 0, 0)).norm(), 1e-9);
  EXPECT_LT((pose.world_from_model * pose.frame.origin_mm - Eigen::Vector3d(31, 2, 3)).norm(), 1e-6);
  EXPECT_LT((pose.world_from_model * Eigen::Vector3d(44, 0, 0) - Eigen::Vector3d(31, 16, 3)).norm(), 1e-6);
}

TEST(Manual, StartsFromTheNominalPlacement) {
  const marrow::Mesh model = tube::cylinder(14, 90);
  marrow::Pose start;
  start.world_from_model.translation_mm = {0, 0, 50};
  start.world_from_model.rotation = marrow::rotation_from_vector({0, 0, marrow::kPi / 2});
  Options options;
  EXPECT_EQ(manual(model, &start, options).world_from_model.translation_mm, start.world_from_model.translation_mm);
  options.translation_mm = {10, 0, 0};  // along the fragment's own x, which is the world's y here
  EXPECT_LT((manual(model, &start, options).world_from_model.translation_mm - Eigen::Vector3d(0, 10, 50)).norm(), 1e-9);
}

TEST(Manual, RefusesAnEmptyModel) {
  try {
    manual(marrow::Mesh{}, nullptr, Options{});
    FAIL();
  } catch (const marrow::Error& error) {
    EXPECT_STREQ(error.what(), "model: the surface has no triangles");
  }
}

}  // namespace
