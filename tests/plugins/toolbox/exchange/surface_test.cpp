// SPDX-License-Identifier: Apache-2.0
// Which side of a surface is out, as read.mesh finds it, and what it says where that is not certain.
#include "marrow/toolbox/exchange/written_files.hpp"
#include "tests/plugins/toolbox/exchange/values.hpp"

namespace surface_test {

using namespace marrow;
using namespace marrow::test;
using Eigen::Vector3d;
using exchange::ObjFile, exchange::VtpFile;
using Surface = InAFolder;
using Faces = std::vector<std::array<int, 3>>;
using SurfaceShape = InAFolder;

Mesh read(const std::filesystem::path& path, double scale = 1) {
  return read_by<Mesh>("read.mesh", path, {{"scale", scale}});
}

/// A tetrahedron with corners at the origin and 1 along each axis: volume 1/6.
const std::string kObj =
    "# by hand\nmtllib a.mtl\no bone\nv 0 0 0\nv 1 0 0 0.5 0.5 0.5\nv 0 1 0\nv 0 0 1\nvn 0 0 1\nvt 0 0\nusemtl grey\n"
    "s off\nf 1 3 2\nf 1//1 2//1 4//1\nf 1/1/1 4/1/1 3/1/1\nf -3 -2 -1\n";

const std::string kVtp =
    "<?xml version=\"1.0\"?>\n<VTKFile type=\"PolyData\" version=\"0.1\" byte_order=\"LittleEndian\">\n<PolyData>\n"
    "<Piece NumberOfPoints=\"4\" NumberOfVerts=\"0\" NumberOfLines=\"0\" NumberOfStrips=\"0\" NumberOfPolys=\"4\">\n"
    "<Points><DataArray type=\"Float64\" NumberOfComponents=\"3\" format=\"ascii\">\n"
    "0 0 0 1 0 0 0 1 0 0 0 1\n</DataArray></Points>\n"
    "<Polys><DataArray type=\"Int64\" Name=\"connectivity\" format=\"ascii\">0 2 1 0 1 3 0 3 2 1 2 3</DataArray>\n"
    "<DataArray type=\"Int64\" Name=\"offsets\" format=\"ascii\">3 6 9 12</DataArray></Polys>\n"
    "</Piece>\n</PolyData>\n</VTKFile>\n";

/// 3D Slicer's mark of the coordinate system: the letters as numbers.
std::string marked(const std::string& numbers) {
  return with(kVtp, "<PolyData>\n",
              "<PolyData>\n<FieldData><Array type=\"String\" Name=\"SPACE\" NumberOfTuples=\"1\" format=\"ascii\">" +
                  numbers + "</Array></FieldData>\n");
}

void expect_tetrahedron(const Mesh& mesh, const std::string& what, double volume) {
  EXPECT_EQ(mesh.vertices_mm.size(), 4u) << what;
  EXPECT_EQ(mesh.triangles.size(), 4u) << what;
  EXPECT_TRUE(is_closed(mesh)) << what;
  EXPECT_NEAR(enclosed_volume_mm3(mesh), volume, 1e-9) << what;
}

TEST_F(Surface, ObjAndVtp) {
  put(folder / "a.obj", kObj);
  put(folder / "a.VTP", kVtp);
  for (const char* name : {"a.obj", "a.VTP"}) {
    expect_tetrahedron(read(folder / name), name, 1 / 6.0);
    expect_tetrahedron(read(folder / name, 10), name, 1000 / 6.0);
    EXPECT_EQ(read(folder / name).vertices_mm[1], Vector3d(1, 0, 0)) << name;
  }
}

TEST_F(Surface, RasBecomesLpsAndStaysTheRightWayOut) {
  put(folder / "a.obj", "# 3D Slicer output. SPACE=RAS\n" + kObj);
  put(folder / "a.vtp", marked("82 65 83 0"));
  for (const char* name : {"a.obj", "a.vtp"}) {
    expect_tetrahedron(read(folder / name), name, 1 / 6.0);
    EXPECT_EQ(read(folder / name).vertices_mm[1], Vector3d(-1, 0, 0)) << name;
    EXPECT_EQ(read(folder / name).vertices_mm[3], Vector3d(0, 0, 1)) << name;
  }
  put(folder / "a.obj", "# 3D Slicer output. SPACE=LPS\n" + kObj);
  put(folder / "a.vtp", marked("76 80 83 0"));
  for (const char* name : {"a.obj", "a.vtp"}) EXPECT_EQ(read(folder / name).vertices_mm[1], Vector3d(1, 0, 0)) << name;
}

TEST_F(Surface, FacesOfMoreCornersBecomeTriangles) {
  std::string cube = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\n";
  cube += "f 4 3 2 1\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";
  put(folder / "a.obj", cube);
  const Mesh mesh = read(folder / "a.obj");
  EXPECT_EQ(mesh.triangles.size(), 12u);
  EXPECT_TRUE(is_closed(mesh));
  EXPECT_DOUBLE_EQ(enclosed_volume_mm3(mesh), 1);
  put(folder / "b.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nf 1 2 3 4\n");
  EXPECT_SAYS(read(folder / "b.obj"), "a face of 4 corners is far from convex or flat, or crosses itself");
}

TEST_F(Surface, WhatIsWrittenIsReadBackToTheLastBit) {
  const Mesh mesh{{{0, 0, 0}, {1.0 / 3, 0, 0}, {0, 1e-9, 0}, {0, 0, 12345.678}},
                  {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}},
                  "ct"};
  written_by<ObjFile>("write.obj", "mesh", mesh, folder / "a.obj");
  const std::string vtp = written_by<VtpFile>("write.vtp", "mesh", mesh, folder / "a.vtp");
  EXPECT_EQ(hash_of(read(folder / "a.obj")), hash_of(mesh));
  EXPECT_EQ(hash_of(read(folder / "a.vtp")), hash_of(mesh));
  EXPECT_EQ(written_by<VtpFile>("write.vtp", "mesh", mesh, folder / "b.vtp"), vtp) << "the same bytes again";
  Mesh odd = mesh;
  odd.frame = "ct\nv 7 7 7";
  written_by<ObjFile>("write.obj", "mesh", odd, folder / "a.obj");
  EXPECT_EQ(read(folder / "a.obj").vertices_mm.size(), 4u) << "the frame's name adds nothing";
}

TEST_F(Surface, DiagnosesFaultsOfObj) {
  expect_faults(folder / "a.obj", kObj,
                {{"f 1 3 2", "f 1 3 9", "a.obj:12: the face names vertex 9; there are 4 before it, counted from 1"},
                 {"f 1 3 2", "f 1 3 0", "a.obj:12: the face names vertex 0; there are 4 before it, counted from 1"},
                 {"f -3", "f -5", "a.obj:15: the face names vertex -5; there are 4 before it, counted from 1"},
                 {"f 1 3 2", "f 1 99999999999999999999 2", "a.obj:12: expected the numbers of vertices, got '999"},
                 {"f 1 3 2", "f 1 3", "a.obj:12: a face needs at least 3 vertices, got 2"},
                 {"v 0 1 0", "v 0 1", "a.obj:6: a vertex needs three numbers 'v x y z', got ''"},
                 {"v 0 1 0", "v 0 1 O", "a.obj:6: a vertex needs three numbers 'v x y z', got 'O'"},
                 {"s off", "w off", "a.obj:11: expected a line of an OBJ file, as 'v x y z' or 'f 1 2 3', got 'w off'"},
                 {"v 0 1 0", "v 0 nan 0", "a.obj"},
                 {"v 0 1 0", "v 0 1e300 0", "a.obj"},
                 {"", "v 0 0 0\n", "there is no face ('f 1 2 3') in it; it is cut off, or no OBJ"}},
                [](const auto& path) { read(path); });
  put(folder / "a.off", "OFF");
  EXPECT_SAYS(read(folder / "a.off"), "a.off: not a surface that can be read; known are .stl, .ply, .obj and .vtp");
}

TEST_F(Surface, DiagnosesFaultsOfVtpAndDamage) {
  expect_faults(
      folder / "a.vtp", kVtp,
      {{"", "solid\n", "expected a surface of VTK in XML, with <VTKFile at its beginning; export it again as .vtp"},
       {"\"PolyData\"", "\"ImageData\"", "its type is not PolyData, so it is no surface; export the"},
       {"NumberOfPoints=\"4\"", "NumberOfPoints=\"4000000000\"",
        "its NumberOfPoints is negative, or more than a file of 544 bytes can hold; it is damaged: export it again"},
       {"NumberOfPoints=\"4\"", "NumberOfPoints = '4000000000'", "its NumberOfPoints is negative, or more than a file"},
       {"NumberOfPolys=\"4\"", "NumberOfPolys=\"-4000000000\"",
        "its NumberOfPolys is negative, or more than a file of "},
       {"NumberOfPolys=\"4\"", "NumberOfPolys=\"-4\"", "its NumberOfPolys is negative, or more than a file of "},
       {"NumberOfComponents=\"3\"", "NumberOfComponents=\"-2147483648\"",
        "its NumberOfComponents is negative, or more than a file of "},
       {"NumberOfPoints=\"4\"", "NumberOfPoints=\"-1\"", "its NumberOfPoints is negative, or more"},
       {"",
        with(with(kVtp, "NumberOfStrips=\"0\"", "NumberOfStrips=\"1\""), "<Polys>",
             "<Strips><DataArray type=\"Int64\" Name=\"connectivity\" format=\"ascii\">0 1 2 3</DataArray>"
             "<DataArray type=\"Int64\" Name=\"offsets\" format=\"ascii\">4</DataArray></Strips><Polys>"),
        "has strips of triangles, which are not read; save it with polygons (VTK: vtkTriangleFilter)"},
       {"", kVtp.substr(0, 500), "VTK cannot read it ("},
       {"0 2 1 0", "0 9 1 0", "a face names point 9; there are 4, counted from 0"},
       {"0 2 1 0", "0 -2 1 0", "a face names point -2; there are 4, counted from 0"},
       {"0 0 0 1 0 0 0 1 0 0 0 1", "0 0 0 1 0 0", "a.vtp"},
       {"0 0 0 1 0 0", "0 0 nan 1 0 0", "a.vtp"},
       {"NumberOfPolys=\"4\"", "NumberOfPolys=\"0\"", "there is no polygon in it; export the surface again"}},
      [](const auto& path) { read(path); });
  const Mesh mesh{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}}};
  const std::string bytes = written_by<VtpFile>("write.vtp", "mesh", mesh, folder / "good.vtp");
  expect_handled(folder, {"a.vtp", bytes, bytes.size(), {}, true}, [](const auto& path) { read(path); },
                 {.cuts = 60, .changes = 200, .memory = 256 << 20, .least_refused = 60});
}

struct Read {
  Mesh mesh;
  std::vector<std::string> warnings;  ///< without the file's name
};

Read noted(const std::filesystem::path& path, double scale = 1) {
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
  return noted(folder / "a.obj");
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
  const Read femoral = noted(path);
  EXPECT_NEAR(enclosed_volume_mm3(femoral.mesh), 31510.49585, 1e-3);
  EXPECT_TRUE(is_closed(femoral.mesh));
  EXPECT_HAS(all(femoral), ": all its triangles faced inwards (enclosed volume -31510.5 mm3), so they were turned");
}

TEST_F(SurfaceShape, RealBonesAreLeftAsTheyAre) {
  // By VTK: the volume in mm3.
  for (const auto& [name, volume_mm3] :
       {std::pair("femur/femur.stl", 399254.9131), {"radius_motion/0.stl", 23048.1194}}) {
    MARROW_NEED_DATA(path, name);
    const Read bone = noted(path);
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

TEST_F(SurfaceShape, AnOpenOneAndOneThatFacesDifferentSidesOrCrossesItselfWarn) {
  const std::string advice = "; costs that need its outline or its inside may be wrong: repair it (MeshLab, Blender)\n";
  const std::string open =
      ": the surface has no certain inside; 3 edges belong to one triangle only, so the surface is open";
  const Read read = of(without_last_face(cube(3, 10, true)));
  EXPECT_EQ(all(read), open + advice);
  EXPECT_EQ(read.mesh.triangles.size(), 11u);
  EXPECT_EQ(all(of(without_last_face(cube(3, 10, false)))),
            open + "; most of its triangles seem to face inwards: turn them" + advice);
  const std::string turned = without_last_face(cube(3, 10, true)) + "f 4 8 5\n";  // the last face is 4 5 8
  EXPECT_HAS(all(of(turned)),
             ": the surface has no certain inside; 3 edges belong to two triangles that face "
             "different sides; costs");
  EXPECT_HAS(all(of(cube(3, 10, true) + "f 1 2 7\n")),
             "; 1 edge belongs to one triangle only, so the surface is open; 2 edges belong to more "
             "than two triangles; costs");
  // Two cubes that share the cube from 15 to 20 mm.
  const Read crossing = of(cube(0, 20, true) + cube(15, 20.5, true, 8));
  ASSERT_EQ(crossing.warnings.size(), 1u) << all(crossing);
  EXPECT_EQ(crossing.warnings[0].rfind(": the surface crosses itself, first seen at (", 0), 0u) << all(crossing);
  EXPECT_HAS(crossing.warnings[0], ") mm; what lies inside is not certain there: repair it");
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

}  // namespace surface_test
