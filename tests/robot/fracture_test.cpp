// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/geometry/fracture.hpp"

#include <gtest/gtest.h>

#include "marrow/domain/error.hpp"

namespace fracture_test {

using marrow::geometry::fracture_centre_mm;

/// A block of 20 x 20 mm about the z axis through (5, -3).
marrow::Mesh block(double from_z, double to_z) {
  marrow::Mesh mesh;
  for (int i = 0; i < 8; ++i)
    mesh.vertices_mm.emplace_back(5 + (i & 1 ? 10 : -10), -3 + (i & 2 ? 10 : -10), i & 4 ? to_z : from_z);
  mesh.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                    {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  return mesh;
}

TEST(Fracture, ItsCentreIsThatOfTheFaceTowardsTheOtherFragment) {
  // The lower block's top face is at z = -2. Its sides count, too, down to 3 mm below.
  const Eigen::Vector3d centre = fracture_centre_mm(block(-62, -2), block(0, 60));
  EXPECT_NEAR(centre.x(), 5, 1);
  EXPECT_NEAR(centre.y(), -3, 1);
  EXPECT_NEAR(centre.z(), -2.5, 0.5);
}

TEST(Fracture, FragmentsFarApartHaveOneToo) {
  EXPECT_NEAR(fracture_centre_mm(block(-62, -2), block(40, 60)).z(), -2.5, 1);
}

TEST(Fracture, ASurfaceWithoutTrianglesIsRefused) {
  try {
    fracture_centre_mm(block(-62, -2), {});
    FAIL() << "no error";
  } catch (const marrow::Error& error) {
    EXPECT_STREQ(error.what(), "the fracture is not found: a fragment's surface has no triangles");
  }
}

}  // namespace fracture_test
