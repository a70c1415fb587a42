// SPDX-License-Identifier: Apache-2.0
// Damaged volumes: cut off, with flipped bytes, and with sizes that lie.
#include <gtest/gtest.h>

#include "marrow/toolbox/files/volume_file.hpp"
#include "tests/plugins/read/damaged.hpp"

namespace damaged_volumes_test {

using namespace damaged;
using namespace marrow::test;
using marrow::files::VolumeReading;
using Path = std::filesystem::path;

void volume_at(const Path& path) {
  VolumeReading reading;
  if (path.extension() == ".tif") reading.voxel_size_mm = {1, 1, 1};
  marrow::files::read_volume_file(path, reading);
}

TEST(Damaged, TiffStack) {
  const TemporaryFolder folder;
  ItkGrid<std::uint16_t> grid{.size = {20, 16, 12}, .samples = std::vector<std::uint16_t>(20 * 16 * 12, 7)};
  Sample sample = written(folder, "stack.tif", grid, false, 0);
  sample.header_bytes = sample.bytes.size();
  expect_handled(folder, sample, volume_at);
}

std::string tiff_pages(const std::vector<std::pair<int, int>>& sizes) {
  std::string bytes = "II" + little(42, 2) + little(8, 4);
  for (std::size_t i = 0; i < sizes.size(); ++i) {
    const auto [width, height] = sizes[i];
    const std::uint64_t values = std::uint64_t(width) * std::uint64_t(height) * 2,
                        begin = bytes.size() + 2 + 12 * 9 + 4;
    const std::pair<int, std::uint64_t> tags[] = {{256, width}, {257, height}, {258, 16},     {259, 1},     {262, 1},
                                                  {273, begin}, {277, 1},      {278, height}, {279, values}};
    bytes += little(9, 2);
    for (const auto& [tag, value] : tags)
      bytes += little(std::uint64_t(tag), 2) + little(4, 2) + little(1, 4) + little(value, 4);
    bytes += little(i + 1 < sizes.size() ? begin + values : 0, 4) + std::string(values, 'x');
  }
  return bytes;
}

TEST(Damaged, TiffPagesOfDifferentSizes) {
  const TemporaryFolder folder;
  for (const auto& sizes :
       std::vector<std::vector<std::pair<int, int>>>{{{8, 8}, {200, 200}}, {{200, 200}, {8, 8}}, {{8, 8}, {8, 9}}}) {
    put(folder / "a.tif", tiff_pages(sizes));
    std::string said;
    EXPECT_EQ(outcome_of([&] { volume_at(folder / "a.tif"); }, "a.tif", kMemory, said), Outcome::refused) << said;
    EXPECT_NE(said.find("page 2 has another size"), std::string::npos) << said;
  }
  put(folder / "a.tif", tiff_pages({{8, 8}, {8, 8}}));
  EXPECT_NO_THROW(volume_at(folder / "a.tif"));
}

TEST(Damaged, MetaImage) {
  const TemporaryFolder folder;
  expect_handled(folder,
                 written(folder, "a.mha", stack(), false, 300,
                         {{"DimSize = 20 16 12", "DimSize = 20 16 99999"},
                          {"DimSize = 20 16 12", "DimSize = 50000 50000 50000"},
                          {"DimSize = 20 16 12", "DimSize = -20 16 12"},
                          {"DimSize = 20 16 12", "DimSize = 20 16"},
                          {"MET_SHORT", "MET_DOUBLE"},
                          {"NDims = 3", "NDims = 30000000"},
                          {"NDims = 3", "NDims = 11"},
                          {"NDims = 3", "NDims = 0"},
                          {"NDims = 3", "NDims = -3"},
                          {"BinaryData = True", "HeaderSize = 999999999\nBinaryData = True"},
                          {"BinaryData = True", "ElementNumberOfChannels = 100000000\nBinaryData = True"}}),
                 volume_at);
  expect_handled(folder,
                 written(folder, "packed.mha", stack(), true, 300,
                         {{"DimSize = 20 16 12", "DimSize = 20 16 4000"},
                          {"DimSize = 20 16 12", "DimSize = 50000 50000 50000"},
                          {"CompressedDataSize = ", "CompressedDataSize = 99999999"}}),
                 volume_at);
}

TEST(Damaged, MetaImageWithItsDataBeside) {
  const TemporaryFolder folder, other;
  write_itk(other / "a.mhd", stack());
  std::filesystem::copy(other / "a.raw", folder / "a.raw");
  const Sample sample{"a.mhd",
                      bytes_of(other / "a.mhd"),
                      300,
                      {{"DimSize = 20 16 12", "DimSize = 20 16 13"}, {"a.raw", "b.raw"}, {"a.raw", "../a.raw"}},
                      true};
  Sample cut = sample;
  cut.header_bytes = std::min(sample.bytes.size(), sample.header_bytes);
  expect_handled(folder, cut, [&](const Path&) {
    try {
      marrow::files::read_volume_file(folder.path(), {});
    } catch (const marrow::Error& error) {
      throw marrow::Error("a.mhd: " + std::string(error.what()));  // the error may name the data or the folder
    }
  });
}

TEST(Damaged, Nrrd) {
  const TemporaryFolder folder;
  expect_handled(folder,
                 written(folder, "a.nrrd", stack(), false, 250,
                         {{"sizes: 20 16 12", "sizes: 20 16 99999"},
                          {"sizes: 20 16 12", "sizes: 50000 50000 50000"},
                          {"sizes: 20 16 12", "sizes: 0 16 12"},
                          {"type: short", "type: double"},
                          {"dimension: 3", "dimension: 300"},
                          {"encoding: raw", "byte skip: 999999999\nencoding: raw"},
                          {"sizes: 20 16 12", "sizes: 20 16 12 12"},
                          {"encoding: raw", "encoding: ascii"},
                          {"sizes: 20 16 12", "sizes: 20 16 3000"}}),
                 volume_at);
  expect_handled(folder,
                 written(folder, "packed.nrrd", stack(), true, 250,
                         {{"sizes: 20 16 12", "sizes: 20 16 4000"}, {"sizes: 20 16 12", "sizes: 50000 50000 50000"}}),
                 volume_at);
}

TEST(Damaged, Nifti) {
  const TemporaryFolder folder;
  const auto dimensions = [](int x, int y, int z) {
    return little(3, 2) + little(std::uint64_t(x), 2) + little(std::uint64_t(y), 2) + little(std::uint64_t(z), 2);
  };
  expect_handled(folder,
                 written(folder, "a.nii", stack(), false, 352,
                         {{dimensions(20, 16, 12), dimensions(20, 16, 13)},
                          {dimensions(20, 16, 12), dimensions(32767, 32767, 32767)},
                          {dimensions(20, 16, 12), dimensions(-20, 16, 12)},
                          {dimensions(20, 16, 12), dimensions(0, 16, 12)},
                          {dimensions(20, 16, 12), little(9, 2) + dimensions(20, 16, 12).substr(2)},
                          {dimensions(20, 16, 12), little(0, 2) + dimensions(20, 16, 12).substr(2)}}),
                 volume_at);
  Sample packed = written(folder, "a.nii.gz", stack(), true, 352);
  packed.header_bytes = 200;
  expect_handled(folder, packed, volume_at);
}

TEST(Damaged, DicomSeries) {
  const TemporaryFolder good, folder;
  for (int k = 0; k < 4; ++k) {
    DicomSlice slice;
    slice.width = slice.height = 32;
    slice.position = {0, 0, double(k)};
    slice.values.assign(1024, std::int16_t(k));
    write_dicom((k == 2 ? good : folder) / ("s" + std::to_string(k) + ".dcm"), slice);
  }
  Sample sample{"s2.dcm", bytes_of(good / "s2.dcm"), 0, {}, false};
  sample.header_bytes = sample.bytes.size() - 2048;
  expect_handled(folder, sample, [&](const Path&) {
    try {
      marrow::files::read_volume_file(folder.path(), {});
    } catch (const marrow::Error& error) {
      throw marrow::Error("s2.dcm: " + std::string(error.what()));  // the error may name its neighbour or the folder
    }
  });
}

}  // namespace damaged_volumes_test
