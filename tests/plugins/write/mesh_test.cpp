// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "marrow/toolbox/files/mesh_file.hpp"
#include "tests/plugins/write/full_disk.hpp"
#include "tests/plugins/write/writing.hpp"

namespace mesh_test {

using writing::write;

marrow::Mesh example() {
  return {{{0, 0, 0}, {1.0 / 3, 0, 0}, {0, 1e-9, 0}, {0, 0, 12345.678}},
          {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}},
          "ct"};
}

TEST(WriteMesh, ReadsBackTheSameToTheLastBit) {
  const marrow::test::TemporaryFolder folder;
  write(example(), folder / "m.ply");
  EXPECT_EQ(marrow::hash_of(marrow::files::read_mesh_file(folder / "m.ply", 1)), marrow::hash_of(example()));
}

TEST(WriteMesh, NameOfTheFrameAddsNothingToTheHeader) {
  const marrow::test::TemporaryFolder folder;
  marrow::Mesh value = example();
  value.frame = "ct\nelement vertex 1000000\r\x1b[2J";
  write(value, folder / "m.ply");
  EXPECT_EQ(marrow::files::read_mesh_file(folder / "m.ply", 1).vertices_mm.size(), 4u);
}

TEST(WriteMesh, FullDisk) {
  const marrow::test::TemporaryFolder folder;
  for (const rlim_t bytes : {0, 100, 300})
    marrow::test::expect_full_disk_is_diagnosed(folder, "m.ply", bytes,
                                                [](const std::string& path) { write(example(), path); });
}

}  // namespace mesh_test
