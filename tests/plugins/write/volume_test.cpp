// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "marrow/toolbox/files/volume_file.hpp"
#include "tests/plugins/write/full_disk.hpp"
#include "tests/plugins/write/writing.hpp"

namespace volume_test {

using marrow::test::TemporaryFolder;
using writing::write;

marrow::Volume example(int size) {
  marrow::Volume value;
  value.grid.size = {size, size, size};
  value.grid.origin_mm = {1, 2, 3};
  for (int i = 0; i < size * size * size; ++i) value.values.push_back(float((i * 7919) % 4001) * 0.37f - 1000);
  return value;
}

TEST(WriteVolume, ReadsBackTheSame) {
  const TemporaryFolder folder;
  const marrow::Volume written = example(9);
  write(written, folder / "ct.mha");
  EXPECT_EQ(marrow::hash_of(marrow::files::read_volume_file(folder / "ct.mha", {})), marrow::hash_of(written));
  write(marrow::SignedField{written.grid, written.values}, folder / "field.mha");
  EXPECT_EQ(marrow::files::read_volume_file(folder / "field.mha", {}).values, written.values);
}

TEST(WriteVolume, FullDisk) {
  const TemporaryFolder folder;
  for (const rlim_t bytes : {0, 100, 5000})
    marrow::test::expect_full_disk_is_diagnosed(folder, "ct.mha", bytes,
                                                [](const std::string& path) { write(example(20), path); });
}

TEST(WriteVolume, RefusesAnEmptyOne) {
  const TemporaryFolder folder;
  EXPECT_SAYS(write(marrow::Volume(), folder / "ct.mha"), "the volume is empty");
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

}  // namespace volume_test
