// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/analytic/body.hpp"
#include "tests/harness/node_test.hpp"

namespace marrow::test::extremes_test {

/// A shaft along z with two condyles of different size below it, the body's right-hand side at negative x.
analytic::Body bone() {
  return {{{0, 0, 70}, {13, 13, 90}}, {{-22, 6, -40}, {12, 20, 14}}, {{22, 6, -40}, {9, 20, 14}}};
}

Mesh surface(const RigidTransform& ct_from_bone = {"ct", "ct"}, bool is_mirrored = false) {
  Mesh mesh = analytic::mesh_of(bone());
  for (Vector3d& vertex : mesh.vertices_mm) {
    if (is_mirrored) vertex.x() *= -1;
    vertex = ct_from_bone * vertex;
  }
  if (is_mirrored)
    for (auto& triangle : mesh.triangles) std::swap(triangle[1], triangle[2]);
  return mesh;
}

using Numbers = Numbers;
using Names = Strings;

Options options() {
  return {{"names", Names{"medial", "lateral", "medial_back", "lateral_back"}},
          {"outward", Numbers{-1, 1, -0.8, 0.8}},
          {"back", Numbers{0, 0, 1, 1}},
          {"up", Numbers{0, 0, -0.2, -0.2}}};
}

std::map<std::string, Vector3d> points_of(const Mesh& mesh, const Options& with) {
  const auto made = call("points.extremes", {{"model", item(mesh)}}, with);
  std::map<std::string, Vector3d> points;
  for (const auto& point : made.at("points").as<Landmarks>().points) points[point.name] = point.model_mm;
  return points;
}

Options with(const std::string& name, const OptionValue& value) {
  Options changed = options();
  changed[name] = value;
  return changed;
}

TEST(Extremes, LieAtTheMiddleOfTheCap) {
  Mesh mesh = surface();
  mesh.vertices_mm.emplace_back(500, 500, 500);  // of no triangle
  const auto points = points_of(mesh, options());
  ASSERT_EQ(points.size(), 4u);
  // A cap of height h on a sphere of radius r, weighted by the height above its base: its middle is h / 3 below its
  // top.
  const analytic::Body sphere{{{3, -4, 5}, {20, 20, 20}}};
  const auto one = points_of(
      analytic::mesh_of(sphere),
      {{"names", Names{"front"}}, {"outward", Numbers{0}}, {"back", Numbers{-1}}, {"up", Numbers{0}}, {"cap_mm", 3.0}});
  EXPECT_NEAR((one.at("front") - Vector3d(3, -4 - 20 + 1, 5)).norm(), 0, 0.15);
  EXPECT_NEAR(points.at("lateral").x(), 31 - 1, 0.3);
  EXPECT_NEAR(points.at("medial").x(), -34 + 1, 0.3);
  EXPECT_NEAR(points.at("medial").y(), 6, 0.5);
  EXPECT_NEAR(points.at("medial").z(), -40, 0.5);
  EXPECT_LT(points.at("medial_back").x(), -15);
  EXPECT_GT(points.at("lateral_back").x(), 15);
}

TEST(Extremes, AreThoseOfTheOtherSideInAMirror) {
  const auto left = points_of(surface(), options()),
             right = points_of(surface({"ct", "ct"}, true), with("side", "right"));
  for (const auto& [name, place] : left)
    EXPECT_LT((right.at(name) - Vector3d(-place.x(), place.y(), place.z())).norm(), 0.05) << name;
}

TEST(Extremes, OfALevelMoveWithTheBone) {
  const Options level = with("level", Names{"medial_back", "lateral_back"});
  const auto plain = points_of(surface(), level);
  RigidTransform turned{"ct", "ct"};
  turned.rotation =
      rotation_from_vector(Vector3d(0, 0, radians(25))) * rotation_from_vector(Vector3d(radians(10), 0, 0));
  turned.translation_mm = {30, -10, 80};
  const auto moved = points_of(surface(turned), level), not_level = points_of(surface(turned), options());
  double off_without_level = 0;
  for (const auto& [name, place] : plain) {
    EXPECT_LT((moved.at(name) - turned * place).norm(), 0.3) << name;
    off_without_level = std::max(off_without_level, (not_level.at(name) - turned * place).norm());
  }
  EXPECT_GT(off_without_level, 2) << "the CT's axes are no longer the bone's";
}

/// A body that is widest from the right to the left: its long axis is the CT's x.
TEST(Extremes, OfTheCtsAxesLieInTheCtsDirectionsWhateverTheShape) {
  const Mesh wide = analytic::mesh_of({{{5, 0, 0}, {90, 30, 40}}});
  Options top{
      {"names", Names{"top"}}, {"outward", Numbers{0}}, {"back", Numbers{0}}, {"up", Numbers{1}}, {"cap_mm", 1.0}};
  const Vector3d along_the_body = points_of(wide, top).at("top");
  EXPECT_NEAR(std::abs(along_the_body.x() - 5), 90, 1);
  top["directions_of"] = std::string("ct");
  EXPECT_LT((points_of(wide, top).at("top") - Vector3d(5, 0, 40)).norm(), 1.0);
}

TEST(Extremes, AreRefusedWhereTheyAreNotDetermined) {
  const auto refusal = [&](const Options& given) {
    return shipped::refusal("points.extremes", {{"model", item(surface())}}, given);
  };
  EXPECT_EQ(refusal(with("outward", Numbers{0, 1, -0.8, 0.8})),
            "point 'medial': outward, back and up are all 0; give a direction");
  EXPECT_EQ(refusal(with("level", Names{"medial"})), "level: expected two names of points, got 1");
  EXPECT_EQ(refusal(with("level", Names{"medial", "laterel"})),
            "level names 'laterel', which is none of the points; did you mean 'lateral'?");
  EXPECT_NE(refusal(with("level", Names{"medial", "medial"})).find("do not settle beside each other"),
            std::string::npos);
  Mesh tetrahedron;
  tetrahedron.vertices_mm = {{0, 0, 0}, {50, 0, 0}, {0, 50, 0}, {0, 0, 90}};
  tetrahedron.triangles = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
  EXPECT_EQ(shipped::refusal("points.extremes", {{"model", item(tetrahedron)}}, options()),
            "no triangle of the surface lies within cap_mm, 3 mm, of its extreme; make cap_mm larger");
}

}  // namespace marrow::test::extremes_test
