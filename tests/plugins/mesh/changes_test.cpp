// SPDX-License-Identifier: Apache-2.0
#include "tests/plugins/project/shapes.hpp"

namespace marrow::test::changes_test {

constexpr const char* kNode = "mesh.smooth";

Mesh smooth(const Mesh& mesh, const Options& options = {}) {
  return output<Mesh>(kNode, "mesh", {{"mesh", item(mesh)}}, options);
}

Mesh rough_sphere() {
  Mesh rough = shapes::sphere(25);
  std::mt19937 random(4);
  for (Vector3d& v : rough.vertices_mm)
    for (int axis = 0; axis < 3; ++axis) v[axis] += 0.2 * (double(random()) / double(std::mt19937::max()) - 0.5);
  return rough;
}

double roughness_mm(const Mesh& mesh, double radius_mm) {
  double sum = 0;
  for (const Vector3d& v : mesh.vertices_mm) sum += std::pow((v - Vector3d(0, 0, 25)).norm() - radius_mm, 2);
  return std::sqrt(sum / double(mesh.vertices_mm.size()));
}

TEST(Smooth, TakesNoiseAndKeepsTheVolume) {
  const Mesh rough = rough_sphere();
  const Mesh smoothed = smooth(rough, {{"iterations", 20}});
  EXPECT_EQ(smoothed.triangles, rough.triangles);
  EXPECT_LT(roughness_mm(smoothed, 25), 0.45 * roughness_mm(rough, 25));
  EXPECT_NEAR(enclosed_volume_mm3(smoothed) / enclosed_volume_mm3(rough), 1, 2e-3);
  EXPECT_EQ(smooth(rough, {{"iterations", 0}}).vertices_mm, rough.vertices_mm);
  EXPECT_LT(roughness_mm(smooth(rough, {{"iterations", 60}, {"pass_band", 0.03}}), 25), roughness_mm(smoothed, 25))
      << "a narrower band";
}

TEST(Smooth, IsStableWhereverItIsAllowed) {
  // A rough ball whose vertices have different numbers of neighbours. If the options are accepted, it keeps its size
  // and does not get rougher: no wave grows by more than 15 %, and a ball is a long wave.
  const Mesh rough = rough_sphere();
  const double volume = enclosed_volume_mm3(rough), area = surface_area_mm2(rough);
  int smoothed = 0, refused = 0;
  for (const int iterations : {1, 20, 200})
    for (const double lambda : {0.01, 0.5, 0.62, 0.7071})
      for (const double band : {0.001, 0.1, 0.3, 1.0}) {
        const Options options{{"iterations", iterations}, {"lambda", lambda}, {"pass_band", band}};
        if (!shipped::refusal(kNode, {{"mesh", item(rough)}}, options).empty()) {
          ++refused;
          continue;
        }
        ++smoothed;
        const Mesh smooth_one = smooth(rough, options);
        EXPECT_NEAR(enclosed_volume_mm3(smooth_one) / volume, 1, 0.05) << iterations << lambda << band;
        EXPECT_LT(surface_area_mm2(smooth_one) / area, 1.15 * 1.15) << iterations << lambda << band;
      }
  EXPECT_GT(smoothed, 12);
  EXPECT_GT(refused, 12);
}

TEST(Smooth, RefusesWhatMakesWavesGrow) {
  // By hand: |mu| = lambda / (1 - lambda pass_band); the shortest wave is multiplied by 1 - 2 lambda |mu| (2 -
  // pass_band), which is -1 at lambda = (sqrt(5) - 1) / 2 with a pass_band of 1. A wave of half the pass band grows by
  // 0.25 * 0.526 * 0.1^2 / 4 in each pair of steps of the defaults: 15 % in ln(1.15) / 0.000658 = 212.5 of them.
  const Mesh box = test::box({0, 0, 0}, {20, 20, 20});
  const auto refusal = [&](std::int64_t iterations, double lambda, double band) {
    return shipped::refusal(kNode, {{"mesh", item(box)}},
                            {{"iterations", iterations}, {"lambda", lambda}, {"pass_band", band}});
  };
  EXPECT_EQ(refusal(1, 0.7, 1.0),
            "mesh to smooth: with lambda 0.7 and pass_band 1 the shortest waves grow with each step, and tear the "
            "surface apart; give a lambda of at most 0.618");
  EXPECT_EQ(refusal(213, 0.5, 0.1),
            "mesh to smooth: 213 iterations inflate waves of the surface by more than 15 %; give at most 212, or a "
            "smaller pass_band or lambda");
  EXPECT_EQ(refusal(212, 0.5, 0.1), "");
}

TEST(Smooth, LeavesVerticesOfNoTriangleWhereTheyAre) {
  Mesh box = test::box({0, 0, 0}, {20, 20, 20});
  box.vertices_mm.emplace_back(1, 2, 3);
  EXPECT_EQ(smooth(box).vertices_mm.back(), Vector3d(1, 2, 3));
}

TEST(Smooth, SaysWhatIsWrongWithAMesh) {
  EXPECT_EQ(shipped::refusal(kNode, {{"mesh", item(Mesh{})}}), "mesh to smooth: the surface has no triangles");
  Mesh open = box({0, 0, 0}, {20, 20, 20});
  open.triangles.pop_back();
  EXPECT_EQ(shipped::refusal(kNode, {{"mesh", item(open)}}),
            "mesh to smooth: it is not closed, as an edge has not just two triangles; a mesh node gives closed ones");
}

Mesh simplify(const Mesh& mesh, const Options& options = {}) {
  return output<Mesh>("mesh.simplify", "mesh", {{"mesh", item(mesh)}}, options);
}

TEST(Simplify, KeepsTheShapeOfASphere) {
  const Mesh sphere = shapes::sphere(25);
  ASSERT_GT(sphere.triangles.size(), 20000u);
  const Mesh simple = simplify(sphere, {{"triangles", 2000}});
  EXPECT_LE(simple.triangles.size(), 2000u);
  EXPECT_GT(simple.triangles.size(), 1800u);
  EXPECT_EQ(simple.frame, sphere.frame);
  EXPECT_TRUE(is_closed(simple));
  for (const Vector3d& vertex : simple.vertices_mm) EXPECT_NEAR((vertex - Vector3d(0, 0, 25)).norm(), 25, 0.1);
  EXPECT_NEAR(enclosed_volume_mm3(simple), 4.0 / 3 * M_PI * 25 * 25 * 25, 0.01 * 4.0 / 3 * M_PI * 25 * 25 * 25);
}

TEST(Simplify, LeavesASmallMeshAsItIs) {
  const Mesh box = test::box({0, 0, 0}, {20, 20, 20});
  const Mesh same = simplify(box);
  EXPECT_EQ(same.vertices_mm, box.vertices_mm);
  EXPECT_EQ(same.triangles, box.triangles);
}

}  // namespace marrow::test::changes_test
