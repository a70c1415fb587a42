// SPDX-License-Identifier: Apache-2.0
// Surfaces, cameras, poses and cases that ask for more work than their size allows, or choose names that harm.
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <algorithm>
#include <ctime>

#include "marrow/runtime/node/abi.hpp"
#include "marrow/toolbox/files/mesh_file.hpp"
#include "marrow/toolbox/files/yaml_values.hpp"
#include "tests/plugins/read/files.hpp"
#include "tests/plugins/read/hostile.hpp"
#include "tests/plugins/read/itk_files.hpp"
#include "tests/plugins/read/reading.hpp"

namespace hostile_texts_test {

using namespace marrow::test;
using Path = std::filesystem::path;

class HostileTexts : public testing::Test {
 protected:
  void expect_mesh(const std::string& bytes, const std::string& text) {
    put(folder / "a.ply", bytes);
    EXPECT_REFUSED(marrow::files::read_mesh_file(folder / "a.ply", 1), "a.ply", text);
  }
  void expect_seeds(const std::string& text, const std::string& said) {
    put(folder / "a.yaml", text);
    EXPECT_REFUSED(marrow::files::read_seeds_file(folder / "a.yaml"), "a.yaml", said);
  }
  TemporaryFolder folder;
};

TEST_F(HostileTexts, PlyElementsWithoutProperties) {
  const std::string head = "ply\nformat ascii 1.0\n";
  const std::string vertex = "element vertex 3\nproperty float x\nproperty float y\nproperty float z\n";
  std::string many = head + vertex;
  for (int i = 0; i < 1500; ++i) many += "element nothing" + std::to_string(i) + " 60000\n";
  expect_mesh(many + "end_header\n0 0 0\n1 0 0\n0 1 0\n", "its element 'nothing0' has no property");
  expect_mesh(head + "element vertex 60\nproperty float x\nproperty float y\nend_header\n" + std::string(500, '1'),
              "its vertices have no x, y and z");
  expect_mesh(head + vertex + vertex + "end_header\n", "gives the element 'vertex' twice");
  expect_mesh(head + "element vertex 1e30\nend_header\n", "expected 'element NAME COUNT'");
  expect_mesh(head + "element vertex -1\nend_header\n", "expected 'element NAME COUNT'");
}

TEST_F(HostileTexts, PlyStripsAreNotLost) {
  const std::string head =
      "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
      "element face 1\nproperty list uchar int vertex_indices\nelement tristrips 1\nproperty list int int "
      "vertex_indices\n";
  expect_mesh(head + "end_header\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 1 2\n4 0 1 2 3\n",
              "has strips of triangles ('tristrips'), which are not read");
}

TEST_F(HostileTexts, PlyListsThatAreTooLong) {
  std::string head =
      "ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty double x\nproperty double y\nproperty double "
      "z\n";
  for (const char* type : {"list uint uchar", "list int uchar", "list uint double"}) {
    std::string bytes = head + "element face 2\nproperty " + type + " vertex_indices\nend_header\n" +
                        std::string(72, '\0') + "\xFF\xFF\xFF\xFE" + std::string(200, '\0');
    expect_mesh(bytes, "has fewer numbers than its header claims");
  }
  expect_mesh(head + "element face 2\nproperty list float uchar vertex_indices\nend_header\n" + std::string(200, '\0'),
              "expected 'property list WHOLE_NUMBER TYPE NAME'");
  std::string text =
      "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nelement face "
      "1\nproperty list uint uint vertex_indices\nend_header\n"
      "0 0 0\n1 0 0\n0 1 0\n";
  expect_mesh(text + "4000000000 0 1 2\n", "has fewer numbers than its header claims");
  expect_mesh(text + "nan 0 1 2\n", "has fewer numbers than its header claims");
  expect_mesh(text + "3 0 1 1e300\n", "a face names vertex 1e+300; there are 3");
  expect_mesh(text + "3 0 1 1.5\n", "a face names vertex 1.5; there are 3");
}

/// A strip of `squares` squares, in all four ways of writing it.
void write_strip(const TemporaryFolder& folder, int squares) {
  std::string header = "element vertex " + std::to_string(2 * squares + 2) +
                       "\nproperty float x\nproperty float y\nproperty float z\nelement face " +
                       std::to_string(2 * squares) + "\nproperty list uchar int vertex_indices\nend_header\n";
  std::string text = "ply\nformat ascii 1.0\n" + header, binary = "ply\nformat binary_little_endian 1.0\n" + header,
              stl(80, ' ');
  const auto append = [](std::string& to, const auto& value) {
    to.append(reinterpret_cast<const char*>(&value), sizeof value);
  };
  for (int i = 0; i < 2 * squares + 2; ++i) {
    text += std::to_string(i / 2) + " " + std::to_string(i % 2) + " 0\n";
    for (const float value : {float(i / 2), float(i % 2), 0.f}) append(binary, value);
  }
  append(stl, std::uint32_t(2 * squares));
  for (int i = 0; i < 2 * squares; ++i) {
    text += "3 " + std::to_string(i) + " " + std::to_string(i + 1) + " " + std::to_string(i + 2) + "\n";
    append(binary, std::uint8_t(3));
    stl.append(12, '\0');
    for (int k = i; k < i + 3; ++k) {
      append(binary, std::int32_t(k));
      for (const float value : {float(k / 2), float(k % 2), 0.f}) append(stl, value);
    }
    stl.append(2, '\0');
  }
  put(folder / "text.ply", text);
  put(folder / "binary.ply", binary);
  put(folder / "a.stl", stl);
}

/// Processor time does not count other programs. The least of five runs is taken, because other programs share the
/// caches.
double seconds_to_read(const Path& path) {
  double least = 1e9;
  for (int i = 0; i < 5; ++i) {
    const std::clock_t begin = std::clock();
    EXPECT_EQ(marrow::files::read_mesh_file(path, 1).triangles.size(), 200000u);
    least = std::min(least, double(std::clock() - begin) / CLOCKS_PER_SEC);
  }
  return least;
}

TEST_F(HostileTexts, PlyIsReadAsFastAsStl) {
  if (marrow::abi_stamp().sanitizers) GTEST_SKIP() << "a sanitizer slows one of them more than the other";
  write_strip(folder, 100000);
  const double stl = seconds_to_read(folder / "a.stl"), binary = seconds_to_read(folder / "binary.ply"),
               text = seconds_to_read(folder / "text.ply");
  EXPECT_LT(binary, 1.5 * stl + 0.1);
  EXPECT_LT(text, 2 * stl + 0.2);
}

TEST_F(HostileTexts, SurfacesOfNumbersThatAreNone) {
  put(folder / "a.stl",
      "solid a\nfacet\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 1e999\nendloop\nendfacet\nendsolid\n");
  EXPECT_REFUSED(marrow::files::read_mesh_file(folder / "a.stl", 1), "a.stl", "a.stl");
  put(folder / "a.stl",
      "solid a\nfacet\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 3x\nendloop\nendfacet\nendsolid\n");
  EXPECT_REFUSED(marrow::files::read_mesh_file(folder / "a.stl", 1), "a.stl",
                 "a facet is not three lines 'vertex x y z'");
  ASSERT_EQ(::mkfifo((folder / "b.stl").c_str(), 0600), 0);
  EXPECT_REFUSED(marrow::files::read_mesh_file(folder / "b.stl", 1), "b.stl", "expected a file, this is none");
}

TEST_F(HostileTexts, YamlAliasesAreRefused) {
  std::string points = "marrow-seeds: 1\nfragments:\n  a: &a {seeds: [";
  for (int i = 0; i < 2000; ++i) points += "[1,2,3],";
  points += "[1,2,3]]}\n";
  for (int i = 0; i < 3000; ++i) points += "  b" + std::to_string(i) + ": *a\n";
  expect_seeds(points, "a.yaml:3:6: anchors and aliases (&name, *name) are not read; write the value out");
}

TEST_F(HostileTexts, YamlWhoseDocumentsHaveNoEnd) {
  for (const char* text : {",", ",\na: 1\n", "a: 1\n---\nb: 2\n"})
    expect_seeds(text, "the file goes on after the end of its first document");
}

TEST_F(HostileTexts, ManyFaultsAreCountedNotListed) {
  std::string text = "marrow-seeds: 1\n";
  for (int i = 0; i < 6000; ++i) text += "key" + std::to_string(i) + ": " + std::string(2, 'x') + "\n";
  expect_seeds(text, "unknown key 'key0'; known: marrow-seeds, fragments");
  const std::string said = message_of([&] { marrow::files::read_seeds_file(folder / "a.yaml"); });
  EXPECT_NE(said.find("\n... and 5951 more"), std::string::npos) << said.substr(0, 500);
  EXPECT_LT(said.size(), 20000u);
  put(folder / "a.yaml", "marrow-seeds: 1\n" + std::string(900, 'k') + ": 1\n");
  EXPECT_LT(message_of([&] { marrow::files::read_seeds_file(folder / "a.yaml"); }).size(), 1000u);
}

TEST_F(HostileTexts, ManyFragments) {
  std::string text = "marrow-seeds: 1\nfragments:\n";
  for (int i = 0; i < 2500; ++i) text += "  f" + std::to_string(i) + ": {seeds: [[1,2,3]]}\n";
  expect_seeds(text, "there are more than 1000 of them");
}

TEST_F(HostileTexts, NamesThatHarm) {
  const auto named = [](const std::string& name) {
    return "marrow-seeds: 1\nfragments:\n  " + name + ": {seeds: [[1, 2, 3]]}\n";
  };
  expect_seeds(named("\"a\\nb\""),
               "a.yaml:3:3: the key 'a\\x0ab' in fragments holds a control character; write it without");
  expect_seeds(named("\"a\\eb\""), "the key 'a\\x1bb' in fragments holds a control character");
  expect_seeds(named("\"a\\u202eb\""), "the key 'a\\u202eb' in fragments holds a control character");
  expect_seeds(named("\"a\\0b\""), "a.yaml:3:3: a text holds the character NUL (\\0); take it out");
  expect_seeds(named("\"\""), "a name is empty");
  expect_seeds(named(std::string(101, 'n')), "a name has 101 bytes; at most 100 are taken");
  put(folder / "a.yaml", named("R\xC3\xB6hrenknochen, distal"));
  EXPECT_EQ(marrow::files::read_seeds_file(folder / "a.yaml").name(0), "R\xC3\xB6hrenknochen, distal");
  EXPECT_SAYS(marrow::test::view_from(nullptr, {"a\n/b", folder / "a.png", folder / "a.yaml"}),
              "the name 'a\\x0a/b' of a view holds a character that cannot be printed; choose another");
}

TEST_F(HostileTexts, CasesThatHarm) {
  const Path here = folder / "case";
  std::filesystem::create_directories(here / "real");
  write_itk(here / "real/ct.mha",
            ItkGrid<std::int16_t>{.size = {3, 3, 3}, .samples = std::vector<std::int16_t>(27, 40)});
  std::filesystem::create_directory_symlink("real", here / "ct");
  shipped::definition_of("read.case");  // so that loading its library does not count as reading
  const auto expect = [&](const std::string& text, const std::string& said) {
    put(here / "case.yaml", text);
    EXPECT_REFUSED(case_at(here), "case.yaml", said);
  };
  const std::string fragments = "fragments: {a: {seeds: [[1, 2, 3]]}}\n";
  expect("marrow-case: 1\nct: ct/ct.mha\nviews: []\n" + fragments,
         "ct: 'ct' is a link to a folder; move the folder itself there");
  expect("marrow-case: 1\nct: real/ct.mha\nviews:\n  - {name: \"x\\ny\", image: a.png, camera: a.yaml}\n" + fragments,
         "case.yaml:4:12: a view: name: the name of a view holds a character that cannot be printed");
  std::string views = "marrow-case: 1\nct: real/ct.mha\nviews:\n";
  for (int i = 0; i < 1500; ++i) views += "  - {name: v" + std::to_string(i) + ", image: a.png, camera: a.yaml}\n";
  expect(views + fragments, "views: there are 1500; at most 1000 are read");
  std::filesystem::rename(here / "case.yaml", folder / "case.yaml");
  std::filesystem::create_symlink("../case.yaml", here / "case.yaml");
  EXPECT_SAYS(case_at(here), "case.yaml: is a link to a place outside the folder");
}

}  // namespace hostile_texts_test
