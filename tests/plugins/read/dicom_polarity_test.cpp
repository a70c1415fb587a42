// SPDX-License-Identifier: Apache-2.0
// Images in which higher values mean less radiation. Each is inverted within the range of its stored bits. So the right
// value of a pixel p of 12 bits is 4095 - p, whatever the other pixels of the frame are.
#include <gtest/gtest.h>

#include "marrow/toolbox/files/sequence_files.hpp"
#include "marrow/toolbox/files/volume_file.hpp"
#include "tests/plugins/read/dicom_text.hpp"
#include "tests/plugins/read/files.hpp"

namespace dicom_polarity_test {

using namespace marrow::test;

/// Two frames of 3 x 2 pixels that differ only in the last pixel.
Elements two_frames(int bits_stored, std::uint32_t last, std::uint32_t last_of_second, const Elements& changed) {
  const bool is_short = bits_stored > 8;
  std::string pixels;
  for (const std::uint32_t end : {last, last_of_second})
    for (const std::uint32_t value : {5u, 100u, 7u, 8u, 9u, end}) pixels += little(value, is_short ? 2 : 1);
  Elements elements = fluoroscopy();
  elements[0x00280008] = "IS:2";
  elements[0x00280010] = "US:2";
  elements[0x00280011] = "US:3";
  elements[0x00280100] = is_short ? "US:16" : "US:8";
  elements[0x00280101] = "US:" + std::to_string(bits_stored);
  elements[0x00280102] = "US:" + std::to_string(bits_stored - 1);
  elements[0x7FE00010] = (is_short ? "OW:" : "OB:") + pixels;
  for (const auto& [tag, value] : changed) elements[tag] = value;
  return elements;
}

class DicomPolarity : public testing::Test {
 protected:
  /// The pixel (column 1, row 0) of both frames, which is stored as 100.
  std::array<double, 2> second_pixels(const Elements& elements) {
    put(folder / "x.dcm", dicom_file(elements));
    std::array<double, 2> values{};
    for (int frame = 1; frame <= 2; ++frame) {
      cv::Mat pixels;
      marrow::files::read_image_file(folder / "x.dcm", frame).pixels.convertTo(pixels, CV_64F);
      values[std::size_t(frame - 1)] = pixels.at<double>(0, 1);
    }
    return values;
  }
  TemporaryFolder folder;
};

const Elements kWhite{{0x00280004, "CS:MONOCHROME1"}}, kLess{{0x00281041, "SS:-1"}};

TEST_F(DicomPolarity, IsTurnedWithinTheStoredBitsNotByTheFramesMaximum) {
  for (const Elements& turned : {kWhite, kLess}) {
    EXPECT_EQ(second_pixels(two_frames(12, 200, 3000, turned)), (std::array<double, 2>{4095 - 100, 4095 - 100}));
    EXPECT_EQ(second_pixels(two_frames(8, 101, 255, turned)), (std::array<double, 2>{255 - 100, 255 - 100}));
    EXPECT_EQ(second_pixels(two_frames(16, 101, 65535, turned)), (std::array<double, 2>{65535 - 100, 65535 - 100}));
  }
  EXPECT_EQ(second_pixels(two_frames(12, 200, 3000, {})), (std::array<double, 2>{100, 100}));
}

TEST_F(DicomPolarity, KeepsTheTypeOfThePixels) {
  put(folder / "x.dcm", dicom_file(two_frames(12, 200, 3000, kWhite)));
  EXPECT_EQ(marrow::files::read_image_file(folder / "x.dcm", 1).pixels.type(), CV_16U);
  for (const marrow::Image& image : marrow::files::read_image_frames(folder / "x.dcm", {}))
    EXPECT_EQ(image.pixels.at<std::uint16_t>(0, 1), 3995);
}

TEST_F(DicomPolarity, OfMoreBitsThanAFloatHoldsIsRefused) {
  Elements image = fluoroscopy();
  image[0x00280004] = "CS:MONOCHROME1";
  image[0x00280010] = image[0x00280011] = "US:1";
  image[0x00280100] = image[0x00280101] = "US:32";
  image[0x00280102] = "US:31";
  image[0x7FE00010] = "OW:" + little(100, 4);
  put(folder / "x.dcm", dicom_file(image));
  EXPECT_SAYS(marrow::files::read_image_file(folder / "x.dcm"),
              "x.dcm: dark is air in this image of 32 bits, and such pixels are inverted up to 24 bits only; export it "
              "with 16 bits");
}

// 12 bits with a sign hold -2048 to 2047, which is turned into itself: p becomes -1 - p.
TEST_F(DicomPolarity, OfPixelsWithASignIsTurnedWithinTheirRange) {
  Elements with_sign = kWhite;
  with_sign[0x00280103] = "US:1";
  EXPECT_EQ(second_pixels(two_frames(12, 200, 4000, with_sign)), (std::array<double, 2>{-101, -101}));
}

// The scaled values are those of the turned pixel: 2 * (4095 - 100) + 10.
TEST_F(DicomPolarity, IsTurnedBeforeTheValuesAreScaled) {
  Elements scaled = kLess;
  scaled[0x00281052] = "DS:10";
  scaled[0x00281053] = "DS:2";
  EXPECT_EQ(second_pixels(two_frames(12, 200, 3000, scaled)), (std::array<double, 2>{8000, 8000}));
}

// The right values are 4095 minus what pydicom reads at this pixel, 3407 and 3375.
TEST_F(DicomPolarity, IsTheSameInEachRealFrame) {
  MARROW_NEED_DATA(path, "strangers/polarity/b12_mono1_two.dcm");
  EXPECT_EQ(marrow::files::read_image_file(path, 1).pixels.at<std::uint16_t>(300, 300), 688);
  EXPECT_EQ(marrow::files::read_image_file(path, 2).pixels.at<std::uint16_t>(300, 300), 720);
}

}  // namespace dicom_polarity_test
