// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "domain/shapes.hpp"
#include "project/shapes.hpp"
#include "shipped.hpp"

namespace smooth_test {

using Eigen::Vector3d;
using marrow::Mesh;

constexpr const char* kNode = "mesh.smooth";

Mesh smooth(const Mesh& mesh, const shipped::Options& options = {}) {
  return shipped::call(kNode, {{"mesh", shipped::item(mesh)}}, options).at("mesh").as<Mesh>();
}

double roughness_mm(const Mesh& mesh, double radius_mm) {
  double sum = 0;
  for (const Vector3d& v : mesh.vertices_mm) sum += std::pow((v - Vector3d(0, 0, 25)).norm() - radius_mm, 2);
  return std::sqrt(sum / double(mesh.vertices_mm.size()));
}

TEST(Smooth, TakesNoiseAndKeepsTheVolume) {
  const Mesh sphere = shapes::sphere(25);
  Mesh rough = sphere;
  std::mt19937 random(4);
  for (Vector3d& v : rough.vertices_mm)
    for (int axis = 0; axis < 3; ++axis) v[axis] += 0.2 * (double(random()) / double(std::mt19937::max()) - 0.5);
  const Mesh smoothed = smooth(rough, {{"iterations", std::int64_t{20}}});
  EXPECT_EQ(smoothed.triangles, rough.triangles);
  EXPECT_LT(roughness_mm(smoothed, 25), 0.45 * roughness_mm(rough, 25));
  EXPECT_NEAR(marrow::enclosed_volume_mm3(smoothed) / marrow::enclosed_volume_mm3(rough), 1, 2e-3);
  EXPECT_EQ(smooth(rough, {{"iterations", std::int64_t{0}}}).vertices_mm, rough.vertices_mm);
  EXPECT_LT(roughness_mm(smooth(rough, {{"iterations", std::int64_t{60}}, {"pass_band", 0.03}}), 25),
            roughness_mm(smoothed, 25))
      << "a narrower band";
}

TEST(Smooth, LeavesVerticesOfNoTriangleWhereTheyAre) {
  Mesh box = marrow::test::box({0, 0, 0}, {20, 20, 20});
  box.vertices_mm.emplace_back(1, 2, 3);
  EXPECT_EQ(smooth(box).vertices_mm.back(), Vector3d(1, 2, 3));
}

TEST(Smooth, SaysWhatIsWrongWithAMesh) {
  EXPECT_EQ(shipped::refusal(kNode, {{"mesh", shipped::item(Mesh{})}}), "mesh to smooth: the surface has no triangles");
  Mesh open = marrow::test::box({0, 0, 0}, {20, 20, 20});
  open.triangles.pop_back();
  EXPECT_EQ(shipped::refusal(kNode, {{"mesh", shipped::item(open)}}),
            "mesh to smooth: it is not closed, as an edge has not just two triangles; a mesh node gives closed ones");
}

}  // namespace smooth_test
