// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "marrow/toolbox/files/mesh_file.hpp"
#include "tests/plugins/read/files.hpp"
#include "tests/plugins/read/reading.hpp"

namespace mesh_test {

using marrow::test::put;
using marrow::test::TemporaryFolder;
using marrow::test::with;

marrow::Mesh read(const std::filesystem::path& path, double scale = 1,
                  const marrow::Context& context = marrow::Context()) {
  return marrow::test::read_by<marrow::Mesh>("read.mesh", path, {{"scale", scale}}, context);
}

/// A tetrahedron with corners at the origin and 1 along each axis: volume 1/6.
const float kCorners[4][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
const int kFaces[4][3] = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};

std::string stl_text() {
  std::string text = "solid tetrahedron\n";
  for (const auto& face : kFaces) {
    text += " facet normal 0 0 0\n  outer loop\n";
    for (int corner : face)
      text += "   vertex " + std::to_string(kCorners[corner][0]) + " " + std::to_string(kCorners[corner][1]) + " " +
              std::to_string(kCorners[corner][2]) + "\n";
    text += "  endloop\n endfacet\n";
  }
  return text + "endsolid\n";
}

std::string stl_binary(const std::string& header = "") {
  std::string bytes = header;
  bytes.resize(80);
  const auto append = [&](const auto& value) { bytes.append(reinterpret_cast<const char*>(&value), sizeof value); };
  append(std::uint32_t(4));
  for (const auto& face : kFaces) {
    for (int k = 0; k < 3; ++k) append(0.0f);
    for (int corner : face)
      for (float coordinate : kCorners[corner]) append(coordinate);
    append(std::uint16_t(0));
  }
  return bytes;
}

std::string ply_text() {
  std::string text =
      "ply\nformat ascii 1.0\ncomment by hand\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
      "property uchar red\nelement face 4\nproperty list uchar int vertex_indices\nend_header\n";
  for (const auto& corner : kCorners)
    text += std::to_string(corner[0]) + " " + std::to_string(corner[1]) + " " + std::to_string(corner[2]) + " 255\n";
  for (const auto& face : kFaces)
    text += "3 " + std::to_string(face[0]) + " " + std::to_string(face[1]) + " " + std::to_string(face[2]) + "\n";
  return text;
}

std::string ply_binary(bool big) {
  std::string bytes = std::string("ply\nformat binary_") + (big ? "big" : "little") +
                      "_endian 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
                      "element face 4\nproperty list uchar int vertex_index\nend_header\n";
  const auto append = [&](const auto& value) {
    std::string raw(reinterpret_cast<const char*>(&value), sizeof value);
    if (big) std::reverse(raw.begin(), raw.end());
    bytes += raw;
  };
  for (const auto& corner : kCorners)
    for (float coordinate : corner) append(coordinate);
  for (const auto& face : kFaces) {
    append(std::uint8_t(3));
    for (int corner : face) append(std::int32_t(corner));
  }
  return bytes;
}

TEST(ReadMesh, EveryFormatGivesTheSameClosedTetrahedron) {
  const TemporaryFolder folder;
  put(folder / "text.stl", stl_text());
  put(folder / "binary.stl", stl_binary());
  put(folder / "solid.stl", stl_binary("solid but binary"));
  put(folder / "text.ply", ply_text());
  put(folder / "little.ply", ply_binary(false));
  put(folder / "big.ply", ply_binary(true));
  for (const char* name : {"text.stl", "binary.stl", "solid.stl", "text.ply", "little.ply", "big.ply"}) {
    const marrow::Mesh mesh = read(folder / name);
    EXPECT_EQ(mesh.vertices_mm.size(), 4u) << name;
    EXPECT_EQ(mesh.triangles.size(), 4u) << name;
    EXPECT_TRUE(is_closed(mesh)) << name;
    EXPECT_NEAR(enclosed_volume_mm3(mesh), 1 / 6.0, 1e-12) << name;
  }
  EXPECT_NEAR(enclosed_volume_mm3(read(folder / "text.stl", 10)), 1000 / 6.0, 1e-9);
}

TEST(ReadMesh, RealBonesAreClosed) {
  for (const char* name : {"femur/femur.stl", "femur/femur_cortex.stl"}) {
    MARROW_NEED_DATA(path, name);
    const marrow::Mesh mesh = read(path);
    EXPECT_TRUE(is_closed(mesh)) << name;
    EXPECT_GT(enclosed_volume_mm3(mesh), 1e4) << name;
  }
  MARROW_NEED_DATA(path, "radius_motion/0.stl");
  EXPECT_GT(read(path).triangles.size(), 1000u);
}

TEST(ReadMesh, DegenerateTrianglesAreLeftOut) {
  const TemporaryFolder folder;
  const std::string sliver =
      " facet normal 0 0 0\n outer loop\n vertex 1 0 0\n vertex 1 0 0\n vertex 0 1 0\n endloop\n endfacet\n";
  put(folder / "a.stl", with(stl_text(), "endsolid", sliver + "endsolid"));
  EXPECT_EQ(read(folder / "a.stl").triangles.size(), 4u);
}

// The tetrahedron is as large as `scale`. A femur has 414 mm: 0.414 m, 414000 micrometres.
TEST(ReadMesh, WarnsOfASizeThatNoBoneHasAndNamesTheUnit) {
  const TemporaryFolder folder;
  put(folder / "a.stl", stl_text());
  const auto said = [&](double scale) {
    std::string warning;
    marrow::Context::Hooks hooks;
    hooks.log = [&](std::string_view message, marrow::LogLevel) { warning += message; };
    read(folder / "a.stl", scale, marrow::Context(hooks));
    return marrow::test::without_folder(warning, folder.path());
  };
  const std::string usual = " mm large, where bones and implants have 5 to 1000";
  EXPECT_EQ(said(0.414), "/a.stl: the surface is 0.414" + usual + "; looks like m: give scale: 414");
  EXPECT_EQ(said(1), "/a.stl: the surface is 1" + usual + "; looks like cm: give scale: 10");
  EXPECT_EQ(said(4.9), "/a.stl: the surface is 4.9" + usual + "; looks like cm: give scale: 49");
  EXPECT_EQ(said(5.1), "");
  EXPECT_EQ(said(999), "");
  EXPECT_EQ(said(1001), "/a.stl: the surface is 1001" + usual);
  EXPECT_EQ(said(414000), "/a.stl: the surface is 4.14e+05" + usual + "; looks like micrometres: give scale: 414");
  EXPECT_EQ(said(0.001), "/a.stl: the surface is 0.001" + usual);
}

TEST(ReadMesh, DamagedFilesAreDiagnosed) {
  const TemporaryFolder folder;
  put(folder / "binary.stl", stl_binary());
  put(folder / "text.stl", stl_text());
  put(folder / "text.ply", ply_text());
  put(folder / "binary.ply", ply_binary(false));
  const auto read_it = [](const auto& path) { read(path); };
  for (const char* name : {"binary.stl", "text.stl", "text.ply", "binary.ply"}) {
    SCOPED_TRACE(name);
    const auto good = folder / name;
    marrow::test::expect_damage_is_diagnosed(good, folder / ("damaged" + good.extension().string()), read_it);
  }
}

TEST(ReadMesh, HeadersThatClaimTooMuchAreRefused) {
  const TemporaryFolder folder;
  std::string bytes = stl_binary();
  const std::uint32_t huge = 4000000000u;
  std::memcpy(bytes.data() + 80, &huge, sizeof huge);
  put(folder / "a.stl", bytes);
  EXPECT_SAYS(read(folder / "a.stl"), "its header claims 4000000000 triangles, but the file has room for 4");
  put(folder / "a.ply", with(ply_text(), "element vertex 4", "element vertex 4000000000"));
  EXPECT_SAYS(read(folder / "a.ply"), "its header claims 4000000000 of 'vertex'");
  put(folder / "b.ply", with(ply_text(), "3 0 2 1", "3 0 9 1"));
  EXPECT_SAYS(read(folder / "b.ply"), "a face names vertex 9; there are 4");
  put(folder / "c.ply", with(ply_text(), "3 0 2 1", "3 0 -2 1"));
  EXPECT_SAYS(read(folder / "c.ply"), "a face names vertex -2");
  put(folder / "d.ply", with(ply_text(), "uchar int", "uchar quad"));
  put(folder / "e.ply", with(ply_binary(false), "uchar int", "uchar quad"));
  EXPECT_SAYS(read(folder / "e.ply"), "unknown PLY type 'quad'");
  put(folder / "f.stl", with(stl_text(), "vertex", "vortex"));
  EXPECT_SAYS(read(folder / "f.stl"), "a facet has 2 vertices; expected 3");
  put(folder / "empty.stl", "solid nothing\nendsolid nothing\n");
  EXPECT_SAYS(read(folder / "empty.stl"), "empty.stl");
  put(folder / "nan.stl", with(stl_text(), "1.000000", "nan"));
  EXPECT_SAYS(read(folder / "nan.stl"), "nan.stl");
  put(folder / "a.off", "OFF");
  EXPECT_SAYS(read(folder / "a.off"), "known are .stl, .ply, .obj and .vtp");
  EXPECT_SAYS(marrow::files::read_mesh_file(folder / "a.off", 1), "known are .stl and .ply");
}

TEST(ReadMesh, MoreThanTheHeaderClaimsIsRefused) {
  const TemporaryFolder folder;
  put(folder / "a.stl", stl_binary() + stl_binary().substr(84));
  EXPECT_SAYS(read(folder / "a.stl"), "claims 4 triangles, which end after 284 bytes, but the file has 484");
  put(folder / "a.ply", ply_binary(false) + "junk");
  EXPECT_SAYS(read(folder / "a.ply"), "bytes of numbers, but the file has ");
}

/// A prism of height 1 on this outline.
std::string prism(const std::vector<std::pair<double, double>>& outline) {
  const int count = int(outline.size());
  std::string vertices, below, above, sides;
  for (const char* z : {" 0\n", " 1\n"})
    for (const auto& [x, y] : outline) vertices += std::to_string(x) + " " + std::to_string(y) + z;
  for (int k = 0; k < count; ++k) {
    const int next = (k + 1) % count;
    below += " " + std::to_string(count - 1 - k);
    above += " " + std::to_string(count + k);
    sides += "4 " + std::to_string(k) + " " + std::to_string(next) + " " + std::to_string(count + next) + " " +
             std::to_string(count + k) + "\n";
  }
  return "ply\nformat ascii 1.0\nelement vertex " + std::to_string(2 * count) +
         "\nproperty double x\nproperty double y\nproperty double z\nelement face " + std::to_string(count + 2) +
         "\nproperty list uchar int vertex_indices\nend_header\n" + vertices + std::to_string(count) + below + "\n" +
         std::to_string(count) + above + "\n" + sides;
}

/// Of all triangles' areas; where two lie over each other, more than that of the surface.
double area_of(const marrow::Mesh& mesh) {
  double area = 0;
  for (const auto& [a, b, c] : mesh.triangles)
    area += (mesh.vertices_mm[b] - mesh.vertices_mm[a]).cross(mesh.vertices_mm[c] - mesh.vertices_mm[a]).norm() / 2;
  return area;
}

TEST(ReadMesh, FacesOfManyCornersAreCoveredOnce) {
  const TemporaryFolder folder;
  const auto area_of_prism = [&](const std::vector<std::pair<double, double>>& outline) {
    put(folder / "a.ply", prism(outline));
    return area_of(read(folder / "a.ply", 1));
  };
  const std::vector<std::pair<double, double>> notch{
      {0, 0}, {4, 0}, {4, 4}, {2, 1}, {0, 4}};  // seen whole from its reflex corner
  EXPECT_NEAR(area_of_prism(notch), 2 * 10 + 12 + 2 * std::hypot(2, 3), 1e-9);
  EXPECT_NEAR(area_of_prism({{0, 0}, {2, 0}, {4, 0}, {4, 2}, {0, 2}}), 2 * 8 + 12, 1e-9);  // a straight corner
  const std::string uncertain = "corners is far from convex or flat, or crosses itself";
  EXPECT_SAYS(area_of_prism({{0, 0}, {1, 1}, {0, 1}, {1, 0}}), "a face of 4 " + uncertain);
  EXPECT_SAYS(area_of_prism({{10, 0}, {-8, 6}, {3, -9.5}, {3, 9.5}, {-8, -6}}),
              "a face of 5 " + uncertain);  // a star, twice round
  EXPECT_SAYS(
      area_of_prism({{0, 0}, {9, 0}, {9, 5}, {8, 5}, {8, 1}, {5, 1}, {5, 5}, {4, 5}, {4, 1}, {1, 1}, {1, 5}, {0, 5}}),
      "a face of 12 " + uncertain);  // a comb
}

TEST(ReadMesh, AFileOfSeveralSolidsMustBeWhole) {
  const TemporaryFolder folder;
  const std::string two = stl_text() + stl_text();
  put(folder / "two.stl", two);
  EXPECT_EQ(read(folder / "two.stl").triangles.size(), 8u);
  for (const std::size_t end :
       {two.size() - 10, two.rfind(" endfacet"), two.rfind("   vertex"), two.rfind("solid t") + 3}) {
    put(folder / "cut.stl", two.substr(0, end));
    EXPECT_SAYS(read(folder / "cut.stl"), "cut off");
  }
  put(folder / "half.stl", with(stl_text(), "  endloop\n endfacet\nendsolid", "endsolid"));
  EXPECT_SAYS(read(folder / "half.stl"), "has no 'endfacet'");
}

}  // namespace mesh_test
