// SPDX-License-Identifier: Apache-2.0
// TIFF stacks that lie: pages that are no slices, fields of other kinds, directories in a circle.
#include <zlib.h>

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
  expect(
      "a.tif",
      stack(
          "<?xml version=\"1.0\"?><OME><Image><Pixels SizeX=\"2\" SizeZ=\"1\" SizeC=\"2\" SizeT=\"1\"/></Image></OME>"),
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
  expect("a.tif", bytes.replace(at, 12, tiff_entry(339, 2, 1, 2)),
         "is cut off or damaged: only 0 pages are whole (libtiff: Incompatible type for \"SampleFormat\")");
}

TEST_F(Hostile, TiffWhosePagesRunInACircle) {
  const std::string start = "II" + number<std::uint16_t>(42) + number<std::uint32_t>(8);
  const std::uint32_t page = std::uint32_t(tiff_directory(0).size());
  put(folder / "a.tif", start + tiff_directory(8 + page) + tiff_directory(0));
  EXPECT_EQ(volume_at(folder / "a.tif").grid.size, (std::array<int, 3>{2, 2, 2}));
  expect("a.tif", start + tiff_directory(8), "only 1 pages are whole (libtiff: TIFF directory 0 has IFD looping");
  expect("a.tif", start + tiff_directory(8 + page) + tiff_directory(8),
         "only 2 pages are whole (libtiff: TIFF directory 1 has IFD looping");
}

// Small files must not take long. The fields of the first one are the same 60000 bytes, unknown and so read each time;
// so are the pixels of the second one.
TEST_F(Hostile, TiffWhosePagesShareTheirBytes) {
  const std::string start = "II" + number<std::uint16_t>(42) + number<std::uint32_t>(60008) + std::string(60000, '\1');
  const auto pages = [&](const std::vector<std::string>& entries) {
    std::string bytes = start;
    for (std::uint32_t page = 0; page < 100; ++page) {
      bytes += number(std::uint16_t(entries.size()));
      for (const std::string& entry : entries) bytes += entry;
      bytes += number(page == 99 ? 0u : std::uint32_t(bytes.size() + 4));
    }
    return bytes;
  };
  std::vector<std::string> entries{tiff_entry(256, 4, 1, 300), tiff_entry(257, 4, 1, 200),  tiff_entry(258, 4, 1, 8),
                                   tiff_entry(259, 4, 1, 1),   tiff_entry(262, 4, 1, 1),    tiff_entry(273, 4, 1, 8),
                                   tiff_entry(278, 4, 1, 200), tiff_entry(279, 4, 1, 60000)};
  expect("a.tif", pages(entries), "its pages lie over each other");
  for (std::uint16_t tag = 40000; tag < 40040; ++tag) entries.push_back(tiff_entry(tag, 3, 30000, 8));
  expect("a.tif", pages(entries), "its pages lie over each other");
}

// A wrong bit in Deflate often gives other pixels, which only the checksum at its end tells.
TEST_F(Hostile, TiffWhoseChecksumIsWrong) {
  std::string pixels(400, '\0'), packed(1000, '\0');
  for (std::size_t i = 0; i < pixels.size(); ++i) pixels[i] = char(i * i % 251);
  uLongf length = packed.size();
  ASSERT_EQ(compress(reinterpret_cast<Bytef*>(packed.data()), &length, reinterpret_cast<const Bytef*>(pixels.data()),
                     pixels.size()),
            Z_OK);
  packed.resize(length);
  const auto image = [&](const std::string& strip) {
    return "II" + number<std::uint16_t>(42) + number(std::uint32_t(8 + strip.size())) + strip +
           number<std::uint16_t>(8) + tiff_entry(256, 4, 1, 20) + tiff_entry(257, 4, 1, 20) + tiff_entry(258, 4, 1, 8) +
           tiff_entry(259, 4, 1, 8) + tiff_entry(262, 4, 1, 1) + tiff_entry(273, 4, 1, 8) + tiff_entry(278, 4, 1, 20) +
           tiff_entry(279, 4, 1, std::uint32_t(strip.size())) + number(0u);
  };
  put(folder / "b.tif", image(packed));
  EXPECT_EQ(marrow::files::read_image_file(folder / "b.tif").pixels.at<std::uint8_t>(19, 19), 399 * 399 % 251);
  packed.back() = char(packed.back() ^ 1);
  put(folder / "b.tif", image(packed));
  EXPECT_SAYS(marrow::files::read_image_file(folder / "b.tif"), "a strip of its pixels does not hold");
}

}  // namespace hostile_tiff_test
