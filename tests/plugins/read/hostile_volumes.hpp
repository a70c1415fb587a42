// SPDX-License-Identifier: Apache-2.0
#pragma once
// The common part of the tests of hostile volumes: a small stack, and the expectation that a file is refused.
#include <gtest/gtest.h>

#include "marrow/toolbox/files/volume_file.hpp"
#include "tests/plugins/read/files.hpp"
#include "tests/plugins/read/hostile.hpp"
#include "tests/plugins/read/itk_files.hpp"

namespace hostile_volumes {

using namespace marrow::test;

inline marrow::Volume volume_at(const std::filesystem::path& path) {
  marrow::files::VolumeReading reading;
  if (path.extension() == ".tif") reading.voxel_size_mm = {1, 1, 1};
  return marrow::files::read_volume_file(path, reading);
}

inline ItkGrid<std::int16_t> stack() {
  ItkGrid<std::int16_t> grid{.size = {8, 6, 5}};
  for (int i = 0; i < 240; ++i) grid.samples.push_back(std::int16_t(i * 13 - 1000));
  return grid;
}

/// Gives the bytes of good files, and expects that other files are refused for a given reason.
class Hostile : public testing::Test {
 protected:
  std::string good(const std::string& name) {
    write_itk(folder / name, stack());
    return bytes_of(folder / name);
  }
  void expect(const std::string& name, const std::string& bytes, const std::string& text) {
    put(folder / name, bytes);
    EXPECT_REFUSED(volume_at(folder / name), name, text);
  }
  TemporaryFolder folder;
};

}  // namespace hostile_volumes
