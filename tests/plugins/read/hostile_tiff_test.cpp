// SPDX-License-Identifier: Apache-2.0
// TIFF stacks that lie: pages that are no slices, fields of other kinds, directories in a circle.
#include "tests/plugins/read/hostile_volumes.hpp"

namespace hostile_tiff_test {

using namespace hostile_volumes;
using namespace marrow::test;

std::string tiff_directory(std::uint32_t next) {
  return number<std::uint16_t>(8) + tiff_entry(256, 4, 1, 2) + tiff_entry(257, 4, 1, 2) + tiff_entry(258, 4, 1, 8) +
         tiff_entry(259, 4, 1, 1) + tiff_entry(262, 4, 1, 1) + tiff_entry(273, 4, 1, 4) + tiff_entry(278, 4, 1, 2) +
         tiff_entry(279, 4, 1, 4) + number(next);
}

TEST_F(Hostile, TiffWhoseZeroIsWhite) {
  const std::string start = "II" + number<std::uint16_t>(42) + number<std::uint32_t>(8);  // 4 pixels are the 8
  const std::uint32_t page = std::uint32_t(tiff_directory(0).size());
  const auto white = [&](std::string bytes) {
    for (const std::size_t at : {bytes.find(tiff_entry(262, 4, 1, 1)), bytes.rfind(tiff_entry(262, 4, 1, 1))})
      bytes.replace(at, 12, tiff_entry(262, 4, 1, 0));
    return bytes;
  };
  put(folder / "a.tif", start + white(tiff_directory(8 + page) + tiff_directory(0)));
  const auto values = volume_at(folder / "a.tif").values;
  EXPECT_EQ(values, (std::vector<float>{247, 255, 255, 255, 247, 255, 255, 255}));
  std::string with_sign = white(tiff_directory(8 + page) + tiff_directory(0));  // SampleFormat instead of RowsPerStrip
  for (std::size_t at; (at = with_sign.find(tiff_entry(278, 4, 1, 2))) != std::string::npos;)
    with_sign.replace(at, 12, tiff_entry(339, 4, 1, 2));
  expect("a.tif", start + with_sign, "its zero is white (PhotometricInterpretation WhiteIsZero)");
}

TEST_F(Hostile, TiffOfImageJWhosePagesAreNoSlices) {
  const std::uint32_t page = std::uint32_t(tiff_directory(0).size());
  const auto stack = [&](const std::string& description) {
    std::string bytes = "II" + number<std::uint16_t>(42) + number<std::uint32_t>(8) + tiff_directory(8 + page);
    bytes += tiff_directory(0);
    const std::size_t at = bytes.find(tiff_entry(278, 4, 1, 2));  // the default does too
    return bytes.replace(at, 12, tiff_entry(270, 2, std::uint32_t(description.size()), 8 + 2 * page)) + description;
  };
  put(folder / "a.tif", stack("ImageJ=1.54f\nimages=2\nslices=2\nchannels=1\n"));
  EXPECT_EQ(volume_at(folder / "a.tif").grid.size, (std::array<int, 3>{2, 2, 2}));
  expect("a.tif", stack("ImageJ=1.54f\nimages=2\nchannels=2\n"), "is an ImageJ stack of 2 channels");
  expect("a.tif", stack("ImageJ=1.54f\nimages=2\nframes=2\n"), "is an ImageJ stack of 2 frames");
  expect("a.tif", stack("<?xml?><OME><Image><Pixels SizeX=\"2\" SizeZ=\"1\" SizeC=\"2\" SizeT=\"1\"/></Image></OME>"),
         "is an OME stack of 2 channels, whose pages are not slices of one volume");
  expect("a.tif", stack("<OME><Pixels SizeC=\"1\" SizeT=\"2\"/></OME>"), "is an OME stack of 2 times");
  expect("a.tif", stack("{\"shape\": [2, 1, 2, 2, 2]}"), "is an array of 4 dimensions, [2, 1, 2, 2, 2]");
  expect("a.tif", stack("{\"axes\": \"TZYX\", \"shape\": [2, 2, 2, 2]}"), "is an array of 4 dimensions, [2, 2, 2, 2]");
  expect("a.tif", stack("{\"shape\": [2, 2, 2], \"axes\": \"TYX\"}"), "is a stack of times");
  expect("a.tif", stack("{\"shape\": [2, 2, 2], \"truncated\": true}"), "its first page stands for several");
  for (const char* slices :
       {"{\"shape\": [2, 2, 2]}", "{\"shape\": [1, 2, 2, 2], \"axes\": \"TZYX\"}",
        "{\"shape\": [2, 2, 2], \"axes\": \"ZYX\"}", "<OME><Pixels SizeC=\"1\" SizeT=\"1\"/></OME>"}) {
    put(folder / "a.tif", stack(slices));
    EXPECT_EQ(volume_at(folder / "a.tif").grid.size, (std::array<int, 3>{2, 2, 2})) << slices;
  }
}

TEST_F(Hostile, TiffFieldsOfKindsThatAreNotRead) {
  std::string bytes = "II" + number<std::uint16_t>(42) + number<std::uint32_t>(8) + tiff_directory(0);
  const std::size_t at = bytes.find(tiff_entry(278, 4, 1, 2));
  expect("a.tif", bytes.replace(at, 12, tiff_entry(339, 8, 1, 2)),
         "its field 339 has no number of a kind that is read");
}

TEST_F(Hostile, TiffWhosePagesRunInACircle) {
  const std::string start = "II" + number<std::uint16_t>(42) + number<std::uint32_t>(8);
  const std::uint32_t page = std::uint32_t(tiff_directory(0).size());
  put(folder / "a.tif", start + tiff_directory(8 + page) + tiff_directory(0));
  EXPECT_EQ(volume_at(folder / "a.tif").grid.size, (std::array<int, 3>{2, 2, 2}));
  expect("a.tif", start + tiff_directory(8), "its pages run in a circle");
  expect("a.tif", start + tiff_directory(8 + page) + tiff_directory(8), "its pages run in a circle");
}

// 5000 entries a page, all of whose values are the same 60000 bytes.
TEST_F(Hostile, TiffWhosePagesShareTheirBytes) {
  std::string bytes = "II" + number<std::uint16_t>(42) + number<std::uint32_t>(60008) + std::string(60000, '\1');
  for (std::uint32_t pages = 0; pages < 100; ++pages) {
    bytes += number<std::uint16_t>(40) + tiff_entry(256, 4, 1, 2) + tiff_entry(257, 4, 1, 2);
    for (int i = 0; i < 38; ++i) bytes += tiff_entry(278, 3, 30000, 8);
    bytes += number(pages == 99 ? 0u : std::uint32_t(bytes.size() + 4));
  }
  expect("a.tif", bytes, "its pages lie over each other");
}

}  // namespace hostile_tiff_test
