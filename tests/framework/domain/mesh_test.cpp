// SPDX-License-Identifier: Apache-2.0
#include <Eigen/LU>

#include "tests/framework/domain/shapes.hpp"
#include "tests/harness/message_of.hpp"

namespace mesh_test {

using Eigen::Vector3d;
using marrow::Mesh;
using marrow::test::box;
using marrow::test::cylinder;
using marrow::test::message_of;

TEST(Mesh, ClosedMeansEachEdgeTwiceInOppositeSenses) {
  Mesh mesh = box({5, 6, 7}, {20, 30, 40});
  EXPECT_TRUE(is_closed(mesh));
  EXPECT_TRUE(is_closed(cylinder({0, 0, 0}, Vector3d::UnitZ(), 5, 10, 7)));
  std::swap(mesh.triangles[3][0], mesh.triangles[3][1]);
  EXPECT_FALSE(is_closed(mesh)) << "one triangle is flipped";
  mesh = box({5, 6, 7}, {20, 30, 40});
  mesh.triangles.pop_back();
  EXPECT_FALSE(is_closed(mesh)) << "one triangle is missing";
  mesh.triangles.pop_back();
  EXPECT_FALSE(is_closed(mesh)) << "an even number of open edges";
  EXPECT_FALSE(is_closed(Mesh{}));
  mesh = box({5, 6, 7}, {20, 30, 40});
  mesh.triangles.insert(mesh.triangles.end(), mesh.triangles.begin(), mesh.triangles.end());
  EXPECT_FALSE(is_closed(mesh)) << "each edge is used four times";
}

TEST(Mesh, EachTriangleThatIsFlippedIsFound) {
  // Whatever the numbers of the vertices, and so the order of the edges.
  std::array<std::uint32_t, 4> v = {0, 1, 2, 3};
  do {
    Mesh mesh;
    mesh.vertices_mm = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    mesh.triangles = {{v[0], v[2], v[1]}, {v[0], v[1], v[3]}, {v[0], v[3], v[2]}, {v[1], v[2], v[3]}};
    EXPECT_TRUE(is_closed(mesh));
    for (auto& triangle : mesh.triangles) {
      std::swap(triangle[1], triangle[2]);
      EXPECT_FALSE(is_closed(mesh));
      std::swap(triangle[1], triangle[2]);
    }
  } while (std::next_permutation(v.begin(), v.end()));
}

TEST(Mesh, TwoSheetsThatMeetInOneVertexAreNoManifold) {
  Mesh mesh = box({0, 0, 0}, {2, 2, 2});
  EXPECT_TRUE(is_manifold(mesh));
  const auto count = std::uint32_t(mesh.vertices_mm.size());
  const Mesh other = box({5, 0, 0}, {2, 2, 2});
  mesh.vertices_mm.insert(mesh.vertices_mm.end(), other.vertices_mm.begin(), other.vertices_mm.end());
  for (auto triangle : other.triangles) {
    for (auto& v : triangle) v += count;
    mesh.triangles.push_back(triangle);
  }
  EXPECT_TRUE(is_manifold(mesh)) << "two parts";
  for (auto& triangle : mesh.triangles) std::replace(triangle.begin(), triangle.end(), count, 0u);
  EXPECT_TRUE(is_closed(mesh));
  EXPECT_FALSE(is_manifold(mesh)) << "which share a corner";
  mesh.triangles.pop_back();
  EXPECT_FALSE(is_manifold(mesh)) << "and one is open";
}

TEST(Mesh, VolumeAndAreaAwayFromTheOrigin) {
  const Mesh mesh = box({500, -600, 700}, {20, 30, 40});
  EXPECT_NEAR(enclosed_volume_mm3(mesh), 24000, 1e-6);
  EXPECT_NEAR(surface_area_mm2(mesh), 2 * (600 + 800 + 1200), 1e-9);
  Mesh inside_out = mesh;
  for (auto& triangle : inside_out.triangles) std::swap(triangle[0], triangle[1]);
  EXPECT_NEAR(enclosed_volume_mm3(inside_out), -24000, 1e-6);
  EXPECT_TRUE(is_closed(inside_out));
}

TEST(Mesh, SamplesLieEvenlyOnTheSurface) {
  const Mesh mesh = box({5, 6, 7}, {20, 30, 40});
  const auto points = sample_surface(mesh, 500);
  ASSERT_EQ(points.size(), 500u);
  int on_top = 0;
  for (const Vector3d& point : points) {
    const Vector3d from_centre = (point - Vector3d(5, 6, 7)).cwiseAbs() - Vector3d(10, 15, 20);
    EXPECT_NEAR(from_centre.maxCoeff(), 0, 1e-9);
    on_top += std::abs(point.z() - 27) < 1e-9;
  }
  EXPECT_NEAR(on_top, 500 * 600.0 / 5200, 2);
  EXPECT_EQ(sample_surface(mesh, 500)[123], points[123]) << "the pattern is fixed";
  EXPECT_EQ(sample_surface(mesh, 1).size(), 1u);
}

TEST(Mesh, SamplesAreUniformInATriangle) {
  Mesh mesh;
  mesh.vertices_mm = {{0, 0, 0}, {6, 0, 0}, {0, 6, 0}, {6, 6, 0}};
  mesh.triangles = {{0, 1, 2}, {3, 2, 1}};
  const auto points = sample_surface(mesh, 3600);
  ASSERT_EQ(points.size(), 3600u);
  // The square in 36 parts; the diagonal halves six of them.
  std::array<int, 36> inside{};
  for (const Vector3d& point : points) ++inside[std::size_t(int(point.y()) * 6 + int(point.x()))];
  for (std::size_t i = 0; i < 36; ++i) EXPECT_NEAR(inside[i], 100, 12) << i;
  // The first half of the points is in the first triangle. Each represents the same area, beginning and ending with
  // half of it.
  EXPECT_LT(points[1799].x() + points[1799].y(), 6);
  EXPECT_GT(points[1800].x() + points[1800].y(), 6);
  const auto share = [&](const Vector3d& p) {
    return std::pow((p.x() + p.y()) / 6, 2);
  };  // of the first triangle's area, between the point and its first corner
  EXPECT_NEAR(share(points[0]), 0.5 / 1800, 1e-9);
  EXPECT_NEAR(share(points[700]), 700.5 / 1800, 1e-9);
  EXPECT_NEAR(points[1].y() / (points[1].x() + points[1].y()), 0.6180339887, 1e-9) << "of the side, the golden section";
}

TEST(FragmentFrame, LongAxisAndCentroidOfACylinderOffTheOrigin) {
  const Vector3d centre(40, -30, 250), along = Vector3d(0, 0.6, 0.8);
  const marrow::FragmentFrame frame = fragment_frame(cylinder(centre, along, 10, 100, 32));
  EXPECT_TRUE(frame.origin_mm.isApprox(centre, 1e-9));
  EXPECT_LT((frame.axes.col(2) - along).norm(), 1e-6);
  EXPECT_LT((frame.axes.col(0) - Vector3d(1, 0, 0)).norm(), 1e-6);
  EXPECT_LT((frame.axes.col(1) - Vector3d(0, 0.8, -0.6)).norm(), 1e-6) << "lateral = long x frontal";
  EXPECT_NEAR(frame.axes.determinant(), 1, 1e-9);
}

TEST(FragmentFrame, CoarseTrianglesGiveTheExactAxis) {
  const marrow::FragmentFrame frame = fragment_frame(marrow::test::box({5, 6, 7}, {20, 30, 100}));
  EXPECT_NEAR((frame.axes - Eigen::Matrix3d::Identity()).norm(), 0, 1e-9);
  EXPECT_NEAR((frame.origin_mm - Vector3d(5, 6, 7)).norm(), 0, 1e-9);
}

TEST(FragmentFrame, LongAxisAgreesWithPlusZ) {
  const marrow::FragmentFrame frame = fragment_frame(cylinder({1, 2, 3}, Vector3d(0.6, 0, -0.8), 10, 100, 32));
  EXPECT_LT((frame.axes.col(2) - Vector3d(-0.6, 0, 0.8)).norm(), 1e-6);
  EXPECT_LT((frame.axes.col(0) - Vector3d(0.8, 0, 0.6)).norm(), 1e-6) << "+x made orthogonal to the long axis";
}

TEST(FragmentFrame, AnotherReferenceWhereTheBoneLiesAlongX) {
  for (const double x : {0.89, 0.91, -0.91}) {
    const Vector3d along(x, 0, std::sqrt(1 - x * x));
    const marrow::FragmentFrame frame = fragment_frame(cylinder({1, 2, 3}, along, 10, 100, 32));
    const Vector3d expected = x == 0.89 ? Vector3d(Vector3d(along.z(), 0, -along.x())) : Vector3d(Vector3d::UnitY());
    EXPECT_LT((frame.axes.col(0) - expected).norm(), 1e-6) << x;
  }
  const marrow::FragmentFrame frame =
      fragment_frame(cylinder({1, 2, 3}, Vector3d(0.99, 0, 0.141067359796658844), 10, 100, 32));
  EXPECT_LT((frame.axes.col(0) - Vector3d(0, 1, 0)).norm(), 1e-6);
  EXPECT_NEAR(frame.axes.determinant(), 1, 1e-9);
}

TEST(Mesh, CheckNamesTheFault) {
  Mesh mesh = box({0, 0, 0}, {1, 1, 1});
  EXPECT_EQ(message_of([&] { check_mesh(mesh, "model"); }), "");
  mesh.vertices_mm[3].y() = -3e38;
  EXPECT_EQ(message_of([&] { check_mesh(mesh, "model"); }),
            "model: a vertex lies 3e+35 m from the origin; expected coordinates in mm, of at most 1 km");
  mesh.vertices_mm[3].y() = 1e6;
  EXPECT_EQ(message_of([&] { check_mesh(mesh, "model"); }), "");
  mesh.vertices_mm[3].y() = std::nan("");
  EXPECT_EQ(message_of([&] { check_mesh(mesh, "model"); }), "model: a vertex is not finite");
  mesh.triangles[2][1] = 8;
  EXPECT_EQ(message_of([&] { check_mesh(mesh, "model"); }), "model: a triangle names vertex 8, but there are only 8");
  EXPECT_EQ(message_of([&] { check_mesh(Mesh{}, "model"); }), "model: the surface has no triangles");
  EXPECT_EQ(message_of([&] { fragment_frame(Mesh{}); }), "fragment frame: the surface has no triangles");
  const Mesh line{{{0, 0, 0}, {0, 0, 1}, {0, 0, 3}}, {{0, 1, 2}}};
  const std::string no_area =
      ": the surface has no area, as all its triangles are points or lines; check the file or the node that it is from";
  EXPECT_EQ(message_of([&] { check_mesh(line, "model"); }), "model" + no_area);
  EXPECT_EQ(message_of([&] { fragment_frame(line); }), "fragment frame" + no_area);
  EXPECT_EQ(message_of([&] { sample_surface(line, 10); }), "points on a surface" + no_area);
}

}  // namespace mesh_test
