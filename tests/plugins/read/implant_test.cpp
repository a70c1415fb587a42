// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/geometry/implant.hpp"

#include <gtest/gtest.h>

#include "shipped.hpp"
#include "tests/plugins/read/files.hpp"

namespace implant_test {

using marrow::test::put;
using marrow::test::TemporaryFolder;

/// A tetrahedron, in the order of STL's facets.
std::string stl(bool closed = true) {
  std::string text = "solid a\n";
  const char* corners[] = {"0 0 0", "40 0 0", "0 60 0", "0 0 90"};
  const int faces[][3] = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
  for (int i = 0; i < (closed ? 4 : 3); ++i) {
    text += "facet normal 0 0 0\nouter loop\n";
    for (const int corner : faces[i]) text += std::string("vertex ") + corners[corner] + "\n";
    text += "endloop\nendfacet\n";
  }
  return text + "endsolid\n";
}

shipped::Options at(const TemporaryFolder& folder) {
  return {{"holes", (folder / "holes.yaml").string()}, {"surface", (folder / "nail.stl").string()}};
}

TEST(ReadImplant, SurfaceAndHoles) {
  const TemporaryFolder folder;
  put(folder / "nail.stl", stl());
  put(folder / "holes.yaml", R"(marrow-implant: 1
holes:
  distal: {centre_mm: [1, 2, 30], axis: [2, 0, 0], diameter_mm: 5.2}
  oblique: {centre_mm: [0, 0, 45], axis: [0, 3, 4], diameter_mm: 4}
)");
  const auto read = shipped::call("read.implant", {}, at(folder)).at("implant").as<marrow::geometry::Implant>();
  ASSERT_EQ(read.holes.size(), 2u);
  EXPECT_EQ(read.holes[0].name, "distal");
  EXPECT_EQ(read.holes[0].centre_mm, Eigen::Vector3d(1, 2, 30));
  EXPECT_EQ(read.holes[0].axis, Eigen::Vector3d(1, 0, 0));
  EXPECT_EQ(read.holes[0].diameter_mm, 5.2);
  EXPECT_TRUE(read.holes[1].axis.isApprox(Eigen::Vector3d(0, 0.6, 0.8), 1e-12));
  EXPECT_EQ(read.surface.triangles.size(), 4u);
  EXPECT_EQ(read.surface.frame, "implant");
}

TEST(ReadImplant, SaysWhatIsWrong) {
  const TemporaryFolder folder;
  put(folder / "nail.stl", stl());
  const auto said = [&](const std::string& holes) {
    put(folder / "holes.yaml", "marrow-implant: 1\n" + holes);
    return shipped::refusal("read.implant", {}, at(folder));
  };
  const auto says = [&](const std::string& holes, const std::string& text) {
    EXPECT_NE(said(holes).find(text), std::string::npos) << said(holes);
  };
  says("holes: {}\n", "holes: expected holes by name, got none; an implant without holes cannot be locked");
  says("holes:\n  a: {centre_mm: [1, 2, 3], axis: [0, 0, 0], diameter_mm: 0}\n",
       "axis: expected a direction, such as [1, 0, 0], got one of length 0");
  says("holes:\n  a: {centre_mm: [1, 2, 3], axis: [0, 0, 0], diameter_mm: 0}\n",
       "diameter_mm: expected more than 0, got 0.000000");
  put(folder / "nail.stl", stl(false));
  says("holes:\n  a: {centre_mm: [1, 2, 3], axis: [0, 0, 1], diameter_mm: 4}\n",
       "nail.stl: the surface is open or not consistently oriented, so it has no inside");
}

}  // namespace implant_test
