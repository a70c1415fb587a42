// SPDX-License-Identifier: Apache-2.0
// A pelvis and the femoral part of a knee replacement.
#include <gtest/gtest.h>

#include <numeric>

#include "shapes.hpp"
#include "shipped.hpp"

namespace other_bones_test {

using namespace marrow;
using phantom::Bone;
using phantom::test::extent;

Bone bone(const std::string& node, const shipped::Options& options) {
  return shipped::call(node, {}, options).at("bone").as<Bone>();
}

/// The number of pieces that do not touch.
std::size_t pieces(const Mesh& mesh) {
  std::vector<std::uint32_t> up(mesh.vertices_mm.size());
  std::iota(up.begin(), up.end(), 0u);
  const auto top = [&](std::uint32_t i) {
    while (up[i] != i) i = up[i] = up[up[i]];
    return i;
  };
  for (const auto& t : mesh.triangles) up[top(t[0])] = top(t[1]), up[top(t[1])] = top(t[2]);
  std::size_t count = 0;
  for (std::uint32_t i = 0; i < up.size(); ++i) count += top(i) == i;
  return count;
}

TEST(SimulatePelvis, HasTheMeasuresItIsMadeFrom) {
  const Bone pelvis = bone("simulate.pelvis", {{"ripple_mm", 0.0}, {"resolution_mm", 3.0}});
  EXPECT_TRUE(is_closed(pelvis.outer) && is_closed(pelvis.inner));
  const Eigen::Vector3d size = extent(pelvis.outer, [](const auto&) { return true; }).sizes();
  EXPECT_NEAR(size.x(), 256, 4);
  EXPECT_NEAR(size.y(), 150, 12);
  EXPECT_NEAR(size.z(), 210, 12);
  // The left and the right half mirror each other.
  EXPECT_NEAR(extent(pelvis.outer, [](const auto& p) { return p.x() > 0; }).max().x(), 0.5 * size.x(), 1);
}

TEST(SimulatePelvis, IsOneBoneWithTwoSocketsWhateverItsShape) {
  for (int seed = 1; seed < 9; ++seed) {
    const Bone pelvis =
        bone("simulate.pelvis",
             {{"shape_seed", std::int64_t(seed)}, {"variation", 1.0}, {"ripple_mm", 0.0}, {"resolution_mm", 4.0}});
    EXPECT_EQ(pieces(pelvis.outer), 1u) << seed;
  }
  const Bone mean = bone("simulate.pelvis", {{"ripple_mm", 0.0}, {"resolution_mm", 3.0}});
  const Bone wide = bone("simulate.pelvis", {{"ripple_mm", 0.0}, {"resolution_mm", 3.0}, {"socket_diameter_mm", 60.0}});
  EXPECT_LT(enclosed_volume_mm3(wide.outer), enclosed_volume_mm3(mean.outer));
}

Mesh implant(const shipped::Options& options) {
  return shipped::call("simulate.knee_implant", {}, options).at("mesh").as<Mesh>();
}

TEST(SimulateKneeImplant, IsAShellWithCondylesThatDiffer) {
  const Mesh part = implant({{"resolution_mm", 1.2}});
  EXPECT_TRUE(is_closed(part));
  EXPECT_EQ(pieces(part), 1u);
  const Eigen::Vector3d size = extent(part, [](const auto&) { return true; }).sizes();
  EXPECT_NEAR(size.x(), 64, 3) << "two condyles of 24 mm, 40 mm apart";
  EXPECT_LT(enclosed_volume_mm3(part), 0.45 * size.prod()) << "a shell is far from a solid block";
  const auto deepest = [&](double side) {
    return extent(part, [&](const auto& p) { return side * p.x() > 10; }).min().z();
  };
  EXPECT_GT(deepest(1), deepest(-1) + 0.3) << "the condyle on the left is smaller";
}

TEST(SimulateKneeImplant, SeedsGiveOtherSizes) {
  const auto drawn = [](std::int64_t seed) {
    return implant({{"implant_seed", seed}, {"variation", 1.0}, {"resolution_mm", 2.0}});
  };
  EXPECT_NE(enclosed_volume_mm3(drawn(1)), enclosed_volume_mm3(drawn(2)));
  EXPECT_EQ(drawn(1).vertices_mm, drawn(1).vertices_mm);
}

// The maker of bones takes the surface that another node made, as it is but for its place.
TEST(SimulateSurface, TakesASurfaceInPlaceOfAFile) {
  const Mesh part = implant({{"resolution_mm", 2.0}});
  const Bone made = shipped::call("simulate.surface", {{"mesh", shipped::item(part)}},
                                  {{"long_bone", false}, {"isocentre_from_distal_end_mm", 20.0}})
                        .at("bone")
                        .as<Bone>();
  EXPECT_NEAR(enclosed_volume_mm3(made.outer), enclosed_volume_mm3(part), 1e-6 * enclosed_volume_mm3(part));
  EXPECT_NEAR(extent(made.outer, [](const auto&) { return true; }).min().z(), -20, 1e-6);
}

}  // namespace other_bones_test
