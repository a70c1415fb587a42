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

// The mean distance that a tube's surface moves, by integration: a shift moves all points alike.
TEST(Manual, ScalesToADistance) {
  const marrow::Mesh model = tube::cylinder(14, 90);
  Options options;
  options.translation_mm = {3, 0, 4};
  options.distance_mm = 12;
  EXPECT_LT((manual(model, nullptr, options).world_from_model.translation_mm - Eigen::Vector3d(7.2, 0, 9.6)).norm(),
            1e-6);
  options.rotation_deg = {5, -3, 2};
  const marrow::Pose pose = manual(model, nullptr, options);
  double sum = 0;
  const auto points_mm = marrow::sample_surface(model, 3000);
  for (const auto& point : points_mm) sum += (pose.world_from_model * point - point).norm() / 3000;
  EXPECT_NEAR(sum, 12, 0.05);
}

TEST(Manual, RefusesADistanceWithoutAMotion) {
  Options options;
  options.distance_mm = 5;
  try {
    manual(tube::cylinder(14, 90), nullptr, options);
    FAIL();
  } catch (const marrow::Error& error) {
    EXPECT_STREQ(error.what(),
                 "distance_mm: no multiple of rotation_deg and translation_mm moves the surface that far; give a "
                 "rotation or translation, or a shorter distance");
  }
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
