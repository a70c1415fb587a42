// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <marrow/domain/mesh.hpp>
#include <marrow/domain/verdict.hpp>
#include <marrow/testing/node.hpp>

namespace node_test = marrow::node_test;

namespace {

/// A box of 20 x 30 x 60 mm about the origin.
marrow::Mesh box() {
  marrow::Mesh mesh;
  for (const double z : {-30, 30})
    for (const double y : {-15, 15})
      for (const double x : {-10, 10}) mesh.vertices_mm.emplace_back(x, y, z);
  mesh.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                    {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  return mesh;
}

/// The verdict on a pose that is known to `deviation_mm` along one axis, and nearly exactly in all else.
marrow::Verdict verdict_at(double deviation_mm) {
  marrow::Pose pose;
  pose.covariance = marrow::Matrix6d(1e-12 * marrow::Matrix6d::Identity());
  (*pose.covariance)(3, 3) = deviation_mm * deviation_mm;
  const auto made =
      node_test::call("verdict.new_node", {{"pose", node_test::item(pose)}, {"model", node_test::item(box())}});
  return made.at("verdict").as<marrow::Verdict>();
}

}  // namespace

TEST(NewNode, TrustsAPoseThatIsKnownWell) {
  const marrow::Verdict verdict = verdict_at(0.5);
  EXPECT_EQ(verdict.judgement, marrow::Judgement::trusted);
  ASSERT_FALSE(verdict.figures.empty());
  EXPECT_NEAR(verdict.figures[0].value, 0.5, 0.02);  // a shift moves all points by the same
}

TEST(NewNode, DoubtsAPoseThatIsHardlyKnown) {
  const marrow::Verdict verdict = verdict_at(2);  // off by more than 2 mm: beyond one standard deviation, 31.7 %
  EXPECT_EQ(verdict.judgement, marrow::Judgement::doubtful);
  EXPECT_NEAR(verdict.failure_probability, 0.317, 0.02);
}
