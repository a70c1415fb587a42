// SPDX-License-Identifier: Apache-2.0
// Surfaces in STL and PLY, and those that ask for more work than their size allows.
#include <sys/stat.h>

#include <ctime>

#include "marrow/runtime/node/abi.hpp"
#include "marrow/toolbox/files/mesh_file.hpp"
#include "tests/plugins/read/damage.hpp"
#include "tests/plugins/read/meshes.hpp"
#include "tests/plugins/read/reading.hpp"

namespace mesh_test {

using namespace marrow;
using namespace marrow::test;

Mesh read(const std::filesystem::path& path, double scale = 1, const Context& context = Context()) {
  return read_by<Mesh>("read.mesh", path, {{"scale", scale}}, context);
}

class ReadMesh : public InAFolder {
 protected:
  Mesh of(const std::string& name, const std::string& bytes, double scale = 1) {
    put(folder / name, bytes);
    return read(folder / name, scale);
  }
  void expect_faulty(const std::string& name, const std::string& good, const std::vector<Fault>& faults) {
    expect_faults(folder / name, good, faults, [](const auto& path) { read(path); });
  }
};

TEST_F(ReadMesh, EveryFormatGivesTheSameClosedTetrahedron) {
  for (const auto& [name, bytes] : {std::pair{"text.stl", stl_text()},
                                    {"binary.stl", stl_binary()},
                                    {"solid.stl", stl_binary("solid but binary")},
                                    {"text.ply", ply_text()},
                                    {"little.ply", ply_binary(false)},
                                    {"big.ply", ply_binary(true)}}) {
    const Mesh mesh = of(name, bytes);
    EXPECT_EQ(mesh.vertices_mm.size(), 4u) << name;
    EXPECT_EQ(mesh.triangles.size(), 4u) << name;
    EXPECT_TRUE(is_closed(mesh)) << name;
    EXPECT_NEAR(enclosed_volume_mm3(mesh), 1 / 6.0, 1e-12) << name;
  }
  EXPECT_NEAR(enclosed_volume_mm3(read(folder / "text.stl", 10)), 1000 / 6.0, 1e-9);
}

TEST_F(ReadMesh, RealBonesAreClosed) {
  for (const char* name : {"femur/femur.stl", "femur/femur_cortex.stl"}) {
    MARROW_NEED_DATA(path, name);
    const Mesh mesh = read(path);
    EXPECT_TRUE(is_closed(mesh)) << name;
    EXPECT_GT(enclosed_volume_mm3(mesh), 1e4) << name;
  }
  MARROW_NEED_DATA(path, "radius_motion/0.stl");
  EXPECT_GT(read(path).triangles.size(), 1000u);
}

TEST_F(ReadMesh, DegenerateTrianglesAreLeftOut) {
  const std::string sliver =
      " facet normal 0 0 0\n outer loop\n vertex 1 0 0\n vertex 1 0 0\n vertex 0 1 0\n endloop\n endfacet\n";
  EXPECT_EQ(of("a.stl", with(stl_text(), "endsolid", sliver + "endsolid")).triangles.size(), 4u);
}

// The tetrahedron is as large as `scale`. A femur has 414 mm: 0.414 m, 414000 micrometres.
TEST_F(ReadMesh, WarnsOfASizeThatNoBoneHasAndNamesTheUnit) {
  put(folder / "a.stl", stl_text());
  const std::string usual = " mm large, where bones and implants have 5 to 1000";
  for (const auto& [scale, large, advice] : {std::tuple{0.414, "0.414", "; looks like m: give scale: 414"},
                                             {1.0, "1", "; looks like cm: give scale: 10"},
                                             {4.9, "4.9", "; looks like cm: give scale: 49"},
                                             {5.1, "", ""},
                                             {999.0, "", ""},
                                             {1001.0, "1001", ""},
                                             {414000.0, "4.14e+05", "; looks like micrometres: give scale: 414"},
                                             {0.001, "0.001", ""}}) {
    std::string warning;
    for (const std::string& line : said_by([&](const Context& context) { read(folder / "a.stl", scale, context); }))
      warning += without_folder(line, folder.path());
    EXPECT_EQ(warning, *large ? "/a.stl: the surface is " + (large + usual) + advice : "") << scale;
  }
}

TEST_F(ReadMesh, TextOfStlIsReadStrictly) {
  const auto solid = [](const std::string& last) {
    return "solid a\nfacet\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 " + last +
           "\nendloop\nendfacet\nendsolid\n";
  };
  expect_faulty("a.stl", stl_text(),
                {{"vertex", "vortex", "a facet has 2 vertices; expected 3"},
                 {"", "solid nothing\nendsolid nothing\n", "a.stl"},
                 {"vertex 0 1 0", "vertex 0 nan 0", "a.stl"},
                 {"", solid("1e999"), "a.stl"},
                 {"", solid("3x"), "a facet is not three lines 'vertex x y z'"},
                 {"  endloop\n endfacet\nendsolid", "endsolid", "has no 'endfacet'"}});
  // A file of several solids must be whole.
  const std::string two = stl_text("tetrahedron") + stl_text("tetrahedron");
  EXPECT_EQ(of("two.stl", two).triangles.size(), 8u);
  for (const std::size_t end :
       {two.rfind("endsolid"), two.rfind(" endfacet"), two.rfind("   vertex"), two.rfind("\nsolid t") + 4})
    EXPECT_SAYS(of("cut.stl", two.substr(0, end)), "cut off");
  ASSERT_EQ(::mkfifo((folder / "pipe.stl").c_str(), 0600), 0);
  EXPECT_REFUSED(read(folder / "pipe.stl"), "pipe.stl", "expected a file, this is none");
  EXPECT_SAYS(of("a.off", "OFF"), "known are .stl, .ply, .obj and .vtp");
  EXPECT_SAYS(files::read_mesh_file(folder / "a.off", 1), "known are .stl and .ply");
}

TEST_F(ReadMesh, HeadersThatClaimTooMuchOrTooLittleAreRefused) {
  expect_faulty("a.stl", stl_binary(),
                {{"", replaced(stl_binary(), 80, number(4000000000u)),
                  "its header claims 4000000000 triangles, but the file has room for 4"},
                 {"", stl_binary() + stl_binary().substr(84),
                  "claims 4 triangles, which end after 284 bytes, but the file has 484"}});
  expect_faulty("b.ply", ply_binary(false),
                {{"uchar int", "uchar quad", "unknown PLY type 'quad'"},
                 {"", ply_binary(false) + "junk", "bytes of numbers, but the file has "}});
  const std::string few = "has fewer numbers than its header claims";
  expect_faulty("a.ply", ply_text(),
                {{"element vertex 4", "element vertex 4000000000", "its header claims 4000000000 of 'vertex'"},
                 {"3 0 2 1", "3 0 9 1", "a face names vertex 9; there are 4"},
                 {"3 0 2 1", "3 0 -2 1", "a face names vertex -2"},
                 {"3 0 2 1", "3 0 2 1e300", "a face names vertex 1e+300; there are 4"},
                 {"3 0 2 1", "3 0 2 1.5", "a face names vertex 1.5; there are 4"},
                 {"", with(with(ply_text(), "uchar int", "uint uint"), "3 0 2 1", "4000000000 0 2 1"), few},
                 {"", with(with(ply_text(), "uchar int", "uint uint"), "3 0 2 1", "nan 0 2 1"), few}});
}

TEST_F(ReadMesh, PlyElementsThatCannotBeAndListsThatAreTooLong) {
  const std::string head = "ply\nformat ascii 1.0\n", vertices = kPlyVertices;
  std::string many = head + vertices;
  for (int i = 0; i < 1500; ++i) many += "element nothing" + std::to_string(i) + " 60000\n";
  const std::string triangle = "0 0 0\n1 0 0\n0 1 0\n", count = "expected 'element NAME COUNT'";
  const std::string strips = "element tristrips 1\nproperty list int int vertex_indices\nend_header\n";
  expect_faulty(
      "a.ply", ply_text(),
      {{"", many + "end_header\n" + triangle + "0 0 1\n", "its element 'nothing0' has no property"},
       {"", head + "element vertex 60\nproperty float x\nproperty float y\nend_header\n" + std::string(500, '1'),
        "its vertices have no x, y and z"},
       {"", head + vertices + vertices + "end_header\n", "gives the element 'vertex' twice"},
       {"", head + "element vertex 1e30\nend_header\n", count},
       {"", head + "element vertex -1\nend_header\n", count},
       {"", with(ply_text(), "end_header\n", strips) + "4 0 1 2 3\n",
        "has strips of triangles ('tristrips'), which are not read"}});
  const std::string list_head =
      "ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty double x\nproperty double y\nproperty double "
      "z\nelement face 2\nproperty list ";
  const auto faces = [&](const std::string& type) { return list_head + type + " vertex_indices\nend_header\n"; };
  std::vector<Fault> faults{
      {"", faces("float uchar") + std::string(200, '\0'), "expected 'property list WHOLE_NUMBER TYPE NAME'"}};
  for (const char* type : {"uint uchar", "int uchar", "uint double"})
    faults.push_back({"", faces(type) + std::string(72, '\0') + "\xFF\xFF\xFF\xFE" + std::string(200, '\0'),
                      "has fewer numbers than its header claims"});
  expect_faulty("a.ply", ply_binary(false), faults);
}

/// A strip of `squares` squares, in all four ways of writing it.
void write_strip(const TemporaryFolder& folder, int squares) {
  const std::string header = "element vertex " + std::to_string(2 * squares + 2) +
                             "\nproperty float x\nproperty float y\nproperty float z\nelement face " +
                             std::to_string(2 * squares) + "\nproperty list uchar int vertex_indices\nend_header\n";
  std::string text = "ply\nformat ascii 1.0\n" + header, binary = "ply\nformat binary_little_endian 1.0\n" + header,
              stl = std::string(80, ' ') + number(std::uint32_t(2 * squares));
  const auto corner = [](int i) { return number(float(i / 2)) + number(float(i % 2)) + number(0.f); };
  for (int i = 0; i < 2 * squares + 2; ++i) {
    text += std::to_string(i / 2) + " " + std::to_string(i % 2) + " 0\n";
    binary += corner(i);
  }
  for (int i = 0; i < 2 * squares; ++i) {
    text += "3 " + std::to_string(i) + " " + std::to_string(i + 1) + " " + std::to_string(i + 2) + "\n";
    binary += '\3' + number(i) + number(i + 1) + number(i + 2);
    stl += std::string(12, '\0') + corner(i) + corner(i + 1) + corner(i + 2) + std::string(2, '\0');
  }
  put(folder / "text.ply", text);
  put(folder / "binary.ply", binary);
  put(folder / "a.stl", stl);
}

/// Processor time does not count other programs. The least of five runs is taken, because other programs share the
/// caches.
double seconds_to_read(const std::filesystem::path& path) {
  double least = 1e9;
  for (int i = 0; i < 5; ++i) {
    const std::clock_t begin = std::clock();
    EXPECT_EQ(files::read_mesh_file(path, 1).triangles.size(), 200000u);
    least = std::min(least, double(std::clock() - begin) / CLOCKS_PER_SEC);
  }
  return least;
}

TEST_F(ReadMesh, PlyIsReadAsFastAsStl) {
  if (abi_stamp().sanitizers) GTEST_SKIP() << "a sanitizer slows one of them more than the other";
  write_strip(folder, 100000);
  const double stl = seconds_to_read(folder / "a.stl"), binary = seconds_to_read(folder / "binary.ply"),
               text = seconds_to_read(folder / "text.ply");
  EXPECT_LT(binary, 1.5 * stl + 0.1);
  EXPECT_LT(text, 2 * stl + 0.2);
}

using Outline = std::vector<std::pair<double, double>>;

/// A prism of height 1 on this outline.
std::string prism(const Outline& outline) {
  const int count = int(outline.size());
  const auto text = [](auto... numbers) { return ((" " + std::to_string(numbers)) + ...); };
  std::string vertices, below = std::to_string(count), above = below, sides;
  for (const int z : {0, 1})
    for (const auto& [x, y] : outline) vertices += text(x, y, z) + "\n";
  for (int k = 0; k < count; ++k) {
    const int next = (k + 1) % count;
    below += text(count - 1 - k);
    above += text(count + k);
    sides += "4" + text(k, next, count + next, count + k) + "\n";
  }
  return "ply\nformat ascii 1.0\nelement vertex" + text(2 * count) +
         "\nproperty double x\nproperty double y\nproperty double z\nelement face" + text(count + 2) +
         "\nproperty list uchar int vertex_indices\nend_header\n" + vertices + below + "\n" + above + "\n" + sides;
}

TEST_F(ReadMesh, FacesOfManyCornersAreCoveredOnce) {
  // Of all triangles; where two lie over each other, more than that of the surface.
  const auto area_of = [&](const Outline& outline) {
    const Mesh mesh = of("a.ply", prism(outline));
    double area = 0;
    for (const auto& [a, b, c] : mesh.triangles)
      area += (mesh.vertices_mm[b] - mesh.vertices_mm[a]).cross(mesh.vertices_mm[c] - mesh.vertices_mm[a]).norm() / 2;
    return area;
  };
  const Outline notch{{0, 0}, {4, 0}, {4, 4}, {2, 1}, {0, 4}};  // seen whole from its reflex corner
  EXPECT_NEAR(area_of(notch), 2 * 10 + 12 + 2 * std::hypot(2, 3), 1e-9);
  EXPECT_NEAR(area_of({{0, 0}, {2, 0}, {4, 0}, {4, 2}, {0, 2}}), 2 * 8 + 12, 1e-9);  // a straight corner
  const std::string uncertain = "corners is far from convex or flat, or crosses itself";
  EXPECT_SAYS(area_of({{0, 0}, {1, 1}, {0, 1}, {1, 0}}), "a face of 4 " + uncertain);
  const Outline star{{10, 0}, {-8, 6}, {3, -9.5}, {3, 9.5}, {-8, -6}};  // twice round
  EXPECT_SAYS(area_of(star), "a face of 5 " + uncertain);
  const Outline comb{{0, 0}, {9, 0}, {9, 5}, {8, 5}, {8, 1}, {5, 1}, {5, 5}, {4, 5}, {4, 1}, {1, 1}, {1, 5}, {0, 5}};
  EXPECT_SAYS(area_of(comb), "a face of 12 " + uncertain);
}

}  // namespace mesh_test
