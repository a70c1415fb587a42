// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "shapes.hpp"
#include "shipped.hpp"

namespace vertebra_test {

using namespace marrow;
using phantom::Bone;
using phantom::test::extent;

Bone vertebra(const shipped::Options& more = {}) {
  shipped::Options options{{"ripple_mm", 0.0}};
  for (const auto& [name, value] : more) options[name] = value;
  return shipped::call("simulate.vertebra", {}, options).at("bone").as<Bone>();
}

TEST(SimulateVertebra, HasTheMeasuresItIsMadeFrom) {
  const Bone bone = vertebra();
  EXPECT_TRUE(is_closed(bone.outer));
  EXPECT_TRUE(is_closed(bone.inner));
  const Eigen::AlignedBox3d all = extent(bone.outer, [](const auto&) { return true; });
  EXPECT_NEAR(all.sizes().x(), 86, 1);  // the transverse processes
  EXPECT_NEAR(all.min().y(), -17, 0.5);
  EXPECT_NEAR(all.max().y(), 87 - 17, 1);                                                         // the spinous process
  const Eigen::AlignedBox3d front = extent(bone.outer, [](const auto& p) { return p.y() < 3; });  // of the body alone
  EXPECT_NEAR(front.sizes().x(), 45, 1);
  EXPECT_NEAR(front.sizes().z(), 27, 1);
  // The end plates are hollow, and the wall is narrower in the middle.
  const auto near_axis = [](const auto& p) { return std::hypot(p.x(), p.y()) < 2; };
  EXPECT_NEAR(extent(bone.outer, near_axis).sizes().z(), 27 - 2 * 1.5, 0.7);
  const Eigen::AlignedBox3d waist = extent(bone.outer, [](const auto& p) { return p.y() < 3 && std::abs(p.z()) < 1; });
  EXPECT_NEAR(waist.sizes().x(), 45 - 2 * 2.5, 1);
}

/// The places where straight lines leave the canal.
TEST(SimulateVertebra, TheCanalIsOpenAndAsWideAsStated) {
  const Bone bone = vertebra();
  double left = 1e9, right = -1e9, front = -1e9, back = 1e9;
  for (const auto& p : bone.outer.vertices_mm) {
    const Eigen::Vector2d from_axis(p.x(), p.y() - 17 - 8.75);
    EXPECT_GT(from_axis.cwiseQuotient(Eigen::Vector2d(12, 8.75)).norm(), 0.93) << p.transpose();
    if (std::abs(from_axis.y()) < 1 && std::abs(p.z() - 4) < 3) {
      if (p.x() > 0) left = std::min(left, p.x());
      if (p.x() < 0) right = std::max(right, p.x());
    }
    if (std::abs(p.x()) < 1 && std::abs(p.z()) < 12) {
      if (from_axis.y() < 0) front = std::max(front, p.y());
      if (from_axis.y() > 0) back = std::min(back, p.y());
    }
  }
  EXPECT_NEAR(left - right, 24, 0.7);
  EXPECT_NEAR(back - front, 17.5, 1);
}

TEST(SimulateVertebra, TheShellIsThinOnTheBody) {
  const Bone bone = vertebra({{"shell_mm", 1.5}});
  const auto wall = [](const Mesh& mesh) {
    return extent(mesh, [](const auto& p) { return p.y() < 3 && std::abs(p.z()) < 1; }).sizes().x();
  };
  EXPECT_NEAR(wall(bone.outer) - wall(bone.inner), 2 * 1.5, 0.3);
}

TEST(SimulateVertebra, SeedsAndVariationGiveOtherVertebrae) {
  const shipped::Options coarse{{"resolution_mm", 1.6}, {"variation", 1.0}, {"ripple_mm", 0.3}};
  const Bone mean = vertebra({{"resolution_mm", 1.6}});
  for (int seed = 1; seed < 9; ++seed) {
    shipped::Options options = coarse;
    options["shape_seed"] = std::int64_t(seed);
    const Bone bone = vertebra(options);
    EXPECT_TRUE(is_closed(bone.outer) && is_closed(bone.inner)) << seed;
    EXPECT_NEAR(enclosed_volume_mm3(bone.outer) / enclosed_volume_mm3(mean.outer), 1, 0.5) << seed;
    EXPECT_NE(enclosed_volume_mm3(bone.outer), enclosed_volume_mm3(mean.outer));
    EXPECT_EQ(bone.outer.vertices_mm, vertebra(options).outer.vertices_mm);
  }
}

}  // namespace vertebra_test
