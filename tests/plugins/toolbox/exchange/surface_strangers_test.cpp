// SPDX-License-Identifier: Apache-2.0
// Surfaces as other programs write them: marks of the frame, and words in other letters, quotes and lines.

#include "tests/plugins/read/meshes.hpp"
#include "tests/plugins/toolbox/exchange/values.hpp"

namespace surface_strangers_test {

using namespace marrow;
using namespace marrow::test;
using Eigen::Vector3d;
using SurfaceFrames = InAFolder;
using SurfaceStrangers = InAFolder;

Mesh read(const std::filesystem::path& path, std::string* said = nullptr) {
  Mesh mesh;
  for (const std::string& line :
       said_by([&](const Context& context) { mesh = read_by<Mesh>("read.mesh", path, {}, context); }))
    if (said) *said += line + "\n";
  return mesh;
}

std::vector<std::array<double, 3>> sorted_vertices(const Mesh& mesh) {
  std::vector<std::array<double, 3>> vertices;
  for (const Vector3d& v : mesh.vertices_mm) vertices.push_back({v.x() + 0.0, v.y() + 0.0, v.z() + 0.0});
  std::sort(vertices.begin(), vertices.end());
  return vertices;
}

/// A tetrahedron with its corners at the origin and at 10, 20 and 30 mm along the axes: 10 * 20 * 30 / 6 = 1000 mm3,
/// as VTK's readers give it for each of the files below.
void expect_tetrahedron(const Mesh& mesh, const std::string& what, double sign = 1) {
  const std::vector<std::array<double, 3>> expected =
      sorted_vertices({{{0, 0, 0}, {sign * 10, 0, 0}, {0, sign * 20, 0}, {0, 0, 30}}, {}, "ct"});
  EXPECT_EQ(sorted_vertices(mesh), expected) << what;
  EXPECT_EQ(mesh.triangles.size(), 4u) << what;
  EXPECT_NEAR(enclosed_volume_mm3(mesh), 1000, 1e-9) << what;
}

const Sides kSides{10, 20, 30};

std::string ply(const std::string& comments) { return ply_text(comments, kSides); }
std::string stl(const std::string& name = "bone") { return stl_text(name, kSides); }

const std::string kObj = "v 0 0 0\nv 10 0 0\nv 0 20 0\nv 0 0 30\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n";

std::string vtp(const std::string& space, const std::string& tag = "<VTKFile type=\"PolyData\" version=\"0.1\">") {
  return "<?xml version=\"1.0\"?>\n" + tag + "\n<PolyData>\n" +
         (space.empty() ? ""
                        : "<FieldData><Array type=\"String\" Name=\"SPACE\" NumberOfTuples=\"1\" format=\"ascii\">" +
                              space + "</Array></FieldData>\n") +
         "<Piece NumberOfPoints=\"4\" NumberOfPolys=\"4\">\n"
         "<Points><DataArray type=\"Float64\" NumberOfComponents=\"3\" format=\"ascii\">\n"
         "0 0 0 10 0 0 0 20 0 0 0 30\n</DataArray></Points>\n"
         "<Polys><DataArray type=\"Int64\" Name=\"connectivity\" format=\"ascii\">0 2 1 0 1 3 1 2 3 2 0 3</DataArray>\n"
         "<DataArray type=\"Int64\" Name=\"offsets\" format=\"ascii\">3 6 9 12</DataArray></Polys>\n"
         "</Piece>\n</PolyData>\n</VTKFile>\n";
}

std::string upper(std::string text) {
  for (char& c : text) c = char(std::toupper(static_cast<unsigned char>(c)));
  return text;
}

TEST_F(SurfaceFrames, AMarkOfRasTurnsEveryFormat) {
  const std::string slicer = "3D Slicer output. SPACE=";
  for (const bool is_ras : {true, false}) {
    const std::string mark = slicer + (is_ras ? "RAS" : "LPS");
    put(folder / "binary.stl", stl_binary(mark, kSides));
    put(folder / "solid.stl", stl_binary("solid " + mark, kSides));
    put(folder / "text.stl", stl(mark));
    put(folder / "title.stl", "# " + mark + "\n" + stl());
    put(folder / "a.ply", ply("comment VTK generated PLY File\ncomment " + mark + "\n"));
    put(folder / "a.obj", "# " + mark + "\n" + kObj);
    put(folder / "a.vtp", vtp(is_ras ? "82 65 83 0" : "76 80 83 0"));
    for (const char* name : {"binary.stl", "solid.stl", "text.stl", "title.stl", "a.ply", "a.obj", "a.vtp"}) {
      std::string said;
      expect_tetrahedron(read(folder / name, &said), name, is_ras ? -1 : 1);
      EXPECT_EQ(said, "") << name;
    }
  }
}

TEST_F(SurfaceFrames, TheFirstMarkCountsAndAContradictionIsSaid) {
  const std::string both = "SPACE=LPS\n# converted from SPACE=RAS\n";
  put(folder / "a.obj", "# " + both + kObj);
  put(folder / "a.ply", ply("comment SPACE=LPS\ncomment converted from SPACE=RAS\n"));
  put(folder / "a.stl", stl("SPACE=LPS, converted from SPACE=RAS"));
  for (const char* name : {"a.obj", "a.ply", "a.stl"}) {
    std::string said;
    expect_tetrahedron(read(folder / name, &said), name);
    EXPECT_EQ(without_folder(said, folder.path()),
              std::string("/") + name +
                  ": names two frames in its comments, SPACE=LPS and SPACE=RAS; the first, LPS, is taken\n");
  }
  put(folder / "a.obj", "# SPACE=RAS\n# was SPACE=LPS\n" + kObj);
  std::string said;
  expect_tetrahedron(read(folder / "a.obj", &said), "RAS first", -1);
  EXPECT_HAS(said, "the first, RAS, is taken");
}

// By VTK and numpy: with x and y negated, the 456 vertices of each RAS file are those of LPS_bin.stl bit for bit, and
// the volume is 348625.37686 mm3.
TEST_F(SurfaceFrames, RealFilesOf3dSlicer) {
  MARROW_NEED_DATA(folder, "strangers/frames");
  const Mesh lps = read(folder / "LPS_bin.stl");
  EXPECT_EQ(lps.vertices_mm.size(), 456u);
  EXPECT_NEAR(enclosed_volume_mm3(lps), 348625.37686, 1e-4);
  for (const char* name : {"RAS_bin.stl", "RAS_txt.stl", "RAS_bin.ply", "RAS_txt.ply"}) {
    const Mesh ras = read(folder / name);
    EXPECT_EQ(sorted_vertices(ras), sorted_vertices(lps)) << name;
    EXPECT_NEAR(enclosed_volume_mm3(ras), 348625.37686, 1e-4) << name;
  }
  expect_tetrahedron(read(folder / "o_spacelps_then_ras.obj"), "LPS first");
}

TEST_F(SurfaceStrangers, RealFilesThatVtkReads) {
  MARROW_NEED_DATA(folder, "strangers/meshes");
  for (const char* name :
       {"lead_newline.stl", "lead_space.stl", "title.stl", "upper.stl", "o_cont.obj", "x_single.vtp", "x_space.vtp"})
    expect_tetrahedron(read(folder / name), name);
}

TEST_F(SurfaceStrangers, StlTextInAnyLettersAndPlyWithAnyLineEnds) {
  const std::string text = stl();
  const std::pair<const char*, std::string> files[] = {
      {"a space", " " + text},
      {"an empty line", "\n\n" + text},
      {"a title", "Exported by a program\n" + text},
      {"capitals", upper(text)},
      {"\\r\\n", with_line_ends(text, "\r\n")},
      {"\\r", with_line_ends(text, "\r")},
      {"a byte order mark", "\xEF\xBB\xBF" + text},
      {"no name", with(text, "solid bone", "solid")},
      {"a name of keywords", with(text, "solid bone", "solid facet solid")}};
  for (const auto& [what, bytes] : files) {
    put(folder / "a.stl", bytes);
    expect_tetrahedron(read(folder / "a.stl"), what);
  }
  put(folder / "a.stl", upper(text.substr(0, text.size() / 2)));
  EXPECT_SAYS(read(folder / "a.stl"), "'endsolid' is missing at its end; the file is cut off, or no STL");
  for (const char* end : {"\n", "\r\n", "\r"}) {
    put(folder / "a.ply", with_line_ends(ply("comment SPACE=RAS\n"), end));
    expect_tetrahedron(read(folder / "a.ply"), "PLY", -1);
  }
  put(folder / "a.ply", "\xEF\xBB\xBF" + ply(""));
  expect_tetrahedron(read(folder / "a.ply"), "a byte order mark");
}

TEST_F(SurfaceStrangers, ObjLinesThatGoOnAndVtpWithAnyQuotesAndBlanks) {
  const std::string vertices = "v 0 0 0\nv 10 0 0\nv 0 20 0\nv 0 0 30\n", faces = "f 1 2 4\nf 2 3 4\nf 3 1 4\n";
  for (const std::string& text : {vertices + "f 1 3 \\\n2\n" + faces,
                                  "v 0 0 0\nv 10 \\\n  0 \\\n  0\nv 0 20 0\nv 0 0 30\nvn 0 \\\n0 1\nf 1 3 2\n" + faces,
                                  "# from C:\\bones\\\nmtllib C:\\a\\\no C:\\\n" + kObj,
                                  with_line_ends(vertices + "f 1 3\\ \n2\n" + faces, "\r\n")}) {
    put(folder / "a.obj", text);
    expect_tetrahedron(read(folder / "a.obj"), text);
  }
  put(folder / "a.obj", kObj + "f 1 \\\n2 \\\n9\n");
  EXPECT_SAYS(read(folder / "a.obj"), "a.obj:9: the face names vertex 9; there are 4 before it, counted from 1");
  put(folder / "a.obj", kObj + "f 1 2 \\\n3\nf 1 2 8\n");
  EXPECT_SAYS(read(folder / "a.obj"), "a.obj:11: the face names vertex 8");
  put(folder / "a.obj", kObj + "f 1 2 \\");
  EXPECT_SAYS(read(folder / "a.obj"), "a.obj:9: expected the numbers of vertices, got '\\'");
  for (const char* tag : {"<VTKFile type='PolyData' version='0.1'>", "<VTKFile version=\"0.1\" type = \"PolyData\">",
                          "<VTKFile header_type=\"UInt32\" version=\"0.1\"\n  type\t=\n'PolyData'>"}) {
    put(folder / "a.vtp", vtp("", tag));
    expect_tetrahedron(read(folder / "a.vtp"), tag);
  }
  put(folder / "a.vtp", vtp("", "<VTKFile type='ImageData' subtype=\"PolyData\">"));
  EXPECT_SAYS(read(folder / "a.vtp"), "its type is not PolyData, so it is no surface");
}

}  // namespace surface_strangers_test
