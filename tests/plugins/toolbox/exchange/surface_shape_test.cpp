// SPDX-License-Identifier: Apache-2.0
// Which side of a surface is out, as read.mesh finds it, and what it says where that is not certain.
#include "tests/plugins/toolbox/exchange/values.hpp"

namespace surface_shape_test {

using namespace marrow;
using namespace marrow::test;
using Faces = std::vector<std::array<int, 3>>;
using SurfaceShape = InAFolder;

struct Read {
  Mesh mesh;
  std::vector<std::string> warnings;  ///< without the file's name
};

Read read(const std::filesystem::path& path, double scale = 1) {
  Read read;
  read.warnings = said_by(
      [&](const Context& context) {
        read.mesh = read_by<Mesh>("read.mesh", path, {{"scale", scale}}, context);
      },
      LogLevel::warning);
  for (std::string& line : read.warnings)
    if (line.starts_with(path.string())) line.erase(0, path.string().size());
  return read;
}

/// A cube from its lowest corner, with the triangles facing outwards or inwards, as lines of OBJ. `before`: the number
/// of vertices before it.
std::string cube(double low, double side, bool outwards, int before = 0) {
  static const int kSides[6][4] = {{4, 3, 2, 1}, {5, 6, 7, 8}, {1, 2, 6, 5}, {2, 3, 7, 6}, {3, 4, 8, 7}, {4, 1, 5, 8}};
  const double high = low + side;
  std::string text;
  for (const double z : {low, high})
    for (const auto& [x, y] : {std::pair(low, low), {high, low}, {high, high}, {low, high}})
      text += "v " + std::to_string(x) + " " + std::to_string(y) + " " + std::to_string(z) + "\n";
  for (const auto& [a, b, c, d] : kSides)
    for (const auto& [i, j, k] : Faces{{a, b, c}, {a, c, d}})
      text += "f " + std::to_string(before + i) + " " + std::to_string(before + (outwards ? j : k)) + " " +
              std::to_string(before + (outwards ? k : j)) + "\n";
  return text;
}

/// The surface in this text, and what is said of it.
Read of(const std::string& text) {
  const TemporaryFolder folder;
  put(folder / "a.obj", text);
  return read(folder / "a.obj");
}

std::string all(const Read& read) {
  std::string text;
  for (const std::string& warning : read.warnings) text += warning + "\n";
  return text;
}

// A cube of 10 mm: 1000 mm3.
TEST_F(SurfaceShape, ACubeThatFacesInwardsIsTurned) {
  const Read out = of(cube(3, 10, true)), in = of(cube(3, 10, false));
  EXPECT_EQ(all(out), "");
  EXPECT_NEAR(enclosed_volume_mm3(out.mesh), 1000, 1e-9);
  EXPECT_NEAR(enclosed_volume_mm3(in.mesh), 1000, 1e-9);
  EXPECT_EQ(all(in),
            ": all its triangles faced inwards (enclosed volume -1000 mm3), so they were turned; if the surface was "
            "mirrored on its way here, it is still a mirror image\n");
}

// VTK's mass of the file is -31510.4958540 mm3, and no edge belongs to one triangle only.
TEST_F(SurfaceShape, ARealImplantThatFacesInwardsIsTurned) {
  MARROW_NEED_DATA(path, "implants/inside_out/KR_right_7_fem.stl");
  const Read femoral = read(path);
  EXPECT_NEAR(enclosed_volume_mm3(femoral.mesh), 31510.49585, 1e-3);
  EXPECT_TRUE(is_closed(femoral.mesh));
  EXPECT_CONTAINS(all(femoral),
                  ": all its triangles faced inwards (enclosed volume -31510.5 mm3), so they were turned");
}

TEST_F(SurfaceShape, RealBonesAreLeftAsTheyAre) {
  // By VTK: the volume in mm3.
  for (const auto& [name, volume_mm3] :
       {std::pair("femur/femur.stl", 399254.9131), {"radius_motion/0.stl", 23048.1194}}) {
    MARROW_NEED_DATA(path, name);
    const Read bone = read(path);
    EXPECT_NEAR(enclosed_volume_mm3(bone.mesh), volume_mm3, 1e-3) << name;
    std::printf("%s: %s\n", name, all(bone).c_str());
  }
}

// 20^3 - 6^3 = 7784 mm3.
TEST_F(SurfaceShape, ACavityFacesInwardsAndIsRight) {
  const Read hollow = of(cube(0, 20, true) + cube(7, 6, false, 8));
  EXPECT_EQ(all(hollow), "");
  EXPECT_NEAR(enclosed_volume_mm3(hollow.mesh), 7784, 1e-9);
  const Read inside_out = of(cube(0, 20, false) + cube(7, 6, true, 8));
  EXPECT_NEAR(enclosed_volume_mm3(inside_out.mesh), 7784, 1e-9);
  EXPECT_EQ(inside_out.warnings.size(), 1u);
}

// 20^3 + 6^3 = 8216 mm3, and once more 6^3.
TEST_F(SurfaceShape, APartThatFacesInwardsBesideAnotherIsTurned) {
  const std::string after =
      " closed parts faced inwards without being a cavity in another part, so they were turned; if the surface was "
      "mirrored on its way here, it is still a mirror image\n";
  const Read small = of(cube(0, 20, true) + cube(30, 6, false, 8)),
             large = of(cube(0, 20, false) + cube(30, 6, true, 8)),
             both = of(cube(0, 20, true) + cube(30, 6, false, 8) + cube(40, 6, false, 16));
  for (const Read* read : {&small, &large}) {
    EXPECT_EQ(all(*read), ": 1 of its 2" + after);
    EXPECT_NEAR(enclosed_volume_mm3(read->mesh), 8216, 1e-9);
  }
  EXPECT_EQ(all(both), ": 2 of its 3" + after);
  EXPECT_NEAR(enclosed_volume_mm3(both.mesh), 8432, 1e-9);
}

/// Without the last of its lines.
std::string without_last_face(std::string text) {
  text.erase(text.rfind("f "));
  return text;
}

TEST_F(SurfaceShape, AnOpenOneWarns) {
  const std::string advice = "; costs that need its outline or its inside may be wrong: repair it (MeshLab, Blender)\n";
  const std::string open =
      ": the surface has no certain inside; 3 edges belong to one triangle only, so the surface is open";
  const Read read = of(without_last_face(cube(3, 10, true)));
  EXPECT_EQ(all(read), open + advice);
  EXPECT_EQ(read.mesh.triangles.size(), 11u);
  EXPECT_EQ(all(of(without_last_face(cube(3, 10, false)))),
            open + "; most of its triangles seem to face inwards: turn them" + advice);
}

TEST_F(SurfaceShape, TrianglesThatFaceDifferentSidesWarn) {
  const std::string turned = without_last_face(cube(3, 10, true)) + "f 4 8 5\n";  // the last face is 4 5 8
  EXPECT_CONTAINS(all(of(turned)),
                  ": the surface has no certain inside; 3 edges belong to two triangles that face "
                  "different sides; costs");
  EXPECT_CONTAINS(all(of(cube(3, 10, true) + "f 1 2 7\n")),
                  "; 1 edge belongs to one triangle only, so the surface is open; 2 edges belong to more "
                  "than two triangles; costs");
}

// Two cubes that share the cube from 15 to 20 mm.
TEST_F(SurfaceShape, OneThatCrossesItselfWarns) {
  const Read crossing = of(cube(0, 20, true) + cube(15, 20.5, true, 8));
  ASSERT_EQ(crossing.warnings.size(), 1u) << all(crossing);
  EXPECT_EQ(crossing.warnings[0].rfind(": the surface crosses itself, first seen at (", 0), 0u) << all(crossing);
  EXPECT_CONTAINS(crossing.warnings[0], ") mm; what lies inside is not certain there: repair it");
  EXPECT_EQ(all(of(cube(0, 20, true) + cube(20, 20, true, 8))), "") << "they only touch";
}

TEST_F(SurfaceShape, AnImplantIsTurnedToo) {
  put(folder / "nail.obj", cube(0, 50, false));
  put(folder / "holes.yaml",
      "marrow-implant: 1\nholes: {a: {centre_mm: [1, 2, 3], axis: [1, 0, 0], diameter_mm: 5}}\n");
  const auto outputs = shipped::call(
      "read.implant", {}, {{"holes", (folder / "holes.yaml").string()}, {"surface", (folder / "nail.obj").string()}});
  EXPECT_NEAR(enclosed_volume_mm3(outputs.at("mesh").as<Mesh>()), 125000, 1e-6);
}

}  // namespace surface_shape_test
