// SPDX-License-Identifier: Apache-2.0
// Damaged meshes: cut off, with flipped bytes, and with counts that lie.
#include <gtest/gtest.h>

#include "marrow/toolbox/files/mesh_file.hpp"
#include "tests/plugins/read/damaged.hpp"

namespace damaged_meshes_test {

using namespace damaged;
using namespace marrow::test;
using Path = std::filesystem::path;

std::string stl_binary(std::uint32_t triangles) {
  std::string bytes(80, ' ');
  bytes += little(triangles, 4);
  for (std::uint32_t i = 0; i < triangles; ++i) {
    float numbers[12] = {0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 1, float(i)};
    bytes.append(reinterpret_cast<const char*>(numbers), sizeof numbers);
    bytes += little(0, 2);
  }
  return bytes;
}

TEST(Damaged, Meshes) {
  const TemporaryFolder folder;
  const auto read = [](const Path& path) { marrow::files::read_mesh_file(path, 1); };
  expect_handled(folder,
                 {"a.stl",
                  stl_binary(100),
                  84,
                  {{little(100, 4), little(0xFFFFFFFFu, 4)}, {little(100, 4), little(101, 4)}},
                  false},
                 read);
  std::string text =
      "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\nelement face 4\n"
      "property list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 "
      "2 3\n";
  expect_handled(folder,
                 {"a.ply",
                  text,
                  200,
                  {{"vertex 4", "vertex 4000000000"},
                   {"vertex 4", "vertex 5"},
                   {"face 4", "face 90000000"},
                   {"\n3 0 2 1", "\n4000000000 0 2 1"},
                   {"3 1 2 3", "3 1 2 9"}},
                  true},
                 read);
  std::string binary =
      "ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float "
      "z\nelement face 1\n"
      "property list uint uint vertex_indices\nend_header\n";
  for (float value : {0.f, 0.f, 0.f, 1.f, 0.f, 0.f, 0.f, 1.f, 0.f})
    binary.append(reinterpret_cast<const char*>(&value), 4);
  binary += little(3, 4) + little(0, 4) + little(1, 4) + little(2, 4);
  expect_handled(folder,
                 {"b.ply",
                  binary,
                  190,
                  {{little(3, 4) + little(0, 4) + little(1, 4), little(0xFFFFFFFFu, 4) + little(0, 4) + little(1, 4)}},
                  false},
                 read);
}

}  // namespace damaged_meshes_test
