// SPDX-License-Identifier: Apache-2.0
// Sound DICOM files that are unusual, or that this program does not read. No message calls them damaged.
#include <gtest/gtest.h>

#include "marrow/toolbox/files/sequence_files.hpp"
#include "marrow/toolbox/files/volume_file.hpp"
#include "tests/plugins/read/dicom_text.hpp"
#include "tests/plugins/read/files.hpp"
#include "tests/plugins/read/itk_files.hpp"

namespace dicom_sound_test {

using namespace marrow::test;

Elements but(Elements elements, const Elements& by) {
  for (const auto& [tag, value] : by) elements[tag] = value;
  return elements;
}

/// An element of undefined length with two fragments and an empty table of offsets, as of compressed pixels.
std::string fragments(std::uint32_t tag, const std::vector<std::string>& parts) {
  const auto item = [](std::uint32_t item_tag, const std::string& content) {
    return little(item_tag >> 16, 2) + little(item_tag & 0xFFFF, 2) + little(std::uint32_t(content.size()), 4) +
           content;
  };
  std::string bytes = little(tag >> 16, 2) + little(tag & 0xFFFF, 2) + "OB" + little(0, 2) + little(0xFFFFFFFF, 4) +
                      item(0xFFFEE000, "");
  for (const std::string& part : parts) bytes += item(0xFFFEE000, part);
  return bytes + item(0xFFFEE0DD, "");
}

class DicomSound : public testing::Test {
 protected:
  marrow::Image image(const std::string& bytes, int frame = 0) {
    put(folder / "x.dcm", bytes);
    return marrow::files::read_image_file(folder / "x.dcm", frame);
  }
  void expect_refused(const std::string& bytes, const std::string& text) {
    const std::string said = message_of([&] { image(bytes); });
    EXPECT_NE(said.find(text), std::string::npos) << (said.empty() ? "(nothing thrown)" : said);
    EXPECT_EQ(said.find("damaged"), std::string::npos) << said;
    EXPECT_EQ(said.find("cut off"), std::string::npos) << said;
  }
  TemporaryFolder folder;
};

// The icon stands in a sequence before the pixels; both may hold any fragments.
TEST_F(DicomSound, CompressedIconsAreSteppedOver) {
  Elements head = fluoroscopy(), pixels;
  pixels[0x7FE00010] = head[0x7FE00010];
  head.erase(0x7FE00010);
  for (const bool is_private : {false, true}) {
    const std::uint32_t tag = is_private ? 0x00091001 : 0x7FE00010;
    const std::string icon = fragments(tag, {"some", std::string("\xFE\xFF\xDD\xE0", 4)});
    const std::string bytes = dicom_start("1.2.840.10008.1.2.1") + dicom_elements(head) +
                              dicom_elements({{0x00880200, dicom_items({icon})}}) + dicom_elements(pixels);
    EXPECT_EQ(image(bytes).pixels.at<std::uint16_t>(3, 1), 301) << is_private;
    const std::string cut = bytes.substr(0, bytes.find("some") + 4);
    EXPECT_SAYS(image(cut), "x.dcm: is cut off or damaged");
  }
}

// A pixel of 8 bits is the number of a colour, so 24 pixels take 24 bytes.
TEST_F(DicomSound, ColoursFromATableAreOnlyCalledColours) {
  const Elements palette{{0x00280004, "CS:PALETTE COLOR"},
                         {0x00280100, "US:8"},
                         {0x00280101, "US:8"},
                         {0x00280102, "US:7"},
                         {0x7FE00010, "OB:" + std::string(24, '\1')}};
  expect_refused(
      dicom_file(but(fluoroscopy(), palette)),
      "x.dcm: its pixels are numbers of colours in a table (PhotometricInterpretation (0028,0004) is PALETTE COLOR), "
      "not grey levels; export it as MONOCHROME2");
}

// Four pixels share a colour, so a pixel has 1.5 values on average.
TEST_F(DicomSound, ColoursWithFewerBytesAreOnlyCalledColours) {
  const Elements colours{{0x00280002, "US:3"}, {0x00280004, "CS:YBR_PARTIAL_420"},
                         {0x00280100, "US:8"}, {0x00280101, "US:8"},
                         {0x00280102, "US:7"}, {0x7FE00010, "OB:" + std::string(36, '\1')}};
  expect_refused(dicom_file(but(fluoroscopy(), colours)), "x.dcm: has 3 channels");
}

TEST_F(DicomSound, ObjectsWithoutAnImageAreCalledSo) {
  expect_refused(dicom_file({{0x00080060, "CS:SR"}}),
                 "x.dcm: holds no image, it is of modality SR; expected a CT slice or an X-ray image");
  expect_refused(dicom_file({{0x00081030, "LO:a study"}}), "x.dcm: holds no image; expected a CT slice");
}

TEST_F(DicomSound, BitsInAnotherPlaceAreOnlyCalledNotRead) {
  expect_refused(dicom_file(but(fluoroscopy(), {{0x00280101, "US:12"}})),
                 "x.dcm: its pixels have 12 of 16 bits, the highest being 15, which is not read; expected 8, 16 or 32 "
                 "bits, the highest being the last that is stored: export it with 16");
  expect_refused(dicom_file(but(fluoroscopy(), {{0x00280100, "US:1"}, {0x00280101, "US:1"}, {0x00280102, "US:0"}})),
                 "x.dcm: its pixels have 1 of 1 bits");
}

// Some programs write the kind of an element although the transfer syntax excludes it, or leave it out.
TEST_F(DicomSound, ElementsAreReadAsTheFirstOneIsWritten) {
  const std::string implicit = "1.2.840.10008.1.2", with_kinds = "1.2.840.10008.1.2.1";
  EXPECT_EQ(image(dicom_start(with_kinds) + implicit_elements(fluoroscopy())).pixels.at<std::uint16_t>(3, 1), 301);
  EXPECT_EQ(image(dicom_start(implicit) + dicom_elements(fluoroscopy())).pixels.at<std::uint16_t>(3, 1), 301);
}

TEST_F(DicomSound, ADataSetWithoutAFilesStartIsRead) {
  const Elements all = but(fluoroscopy(), {{0x00080005, "CS:ISO_IR 100"}});
  EXPECT_EQ(image(dicom_elements(all)).pixels.at<std::uint16_t>(3, 1), 301);
  EXPECT_EQ(image(implicit_elements(all)).pixels.at<std::uint16_t>(3, 1), 301);
}

/// The one compressed frame of a file: what stands between the table of offsets and the end.
std::string compressed_frame(const std::string& bytes) {
  const std::size_t pixels = bytes.find(std::string("\xE0\x7F\x10\0OB", 6)), table = pixels + 12;
  const auto length_at = [&](std::size_t at) {
    return std::size_t(std::uint8_t(bytes[at])) | std::size_t(std::uint8_t(bytes[at + 1])) << 8;
  };
  const std::size_t item = table + 8 + length_at(table + 4);
  return bytes.substr(item + 8, length_at(item + 4));
}

// Two frames in three fragments each, without a table of offsets. GDCM compressed the frame.
TEST_F(DicomSound, FramesInSeveralFragmentsNeedNoTableOfOffsets) {
  put(folder / "plain.dcm", dicom_file(but(fluoroscopy(), {{0x00080018, "UI:1.2.3"}})));
  compress_dicom(folder / "plain.dcm", folder / "packed.dcm", "1.2.840.10008.1.2.4.70");
  std::string frame = compressed_frame(bytes_of(folder / "packed.dcm"));
  ASSERT_GT(frame.size(), 8u);
  ASSERT_EQ(frame.substr(0, 2), "\xFF\xD8");
  Elements head = but(fluoroscopy(), {{0x00280008, "IS:2"}});
  head.erase(0x7FE00010);
  const std::vector<std::string> parts{frame.substr(0, 4), frame.substr(4, 2), frame.substr(6)};
  std::vector<std::string> twice = parts;
  twice.insert(twice.end(), parts.begin(), parts.end());
  const auto file = [&](const std::vector<std::string>& all) {
    return dicom_start("1.2.840.10008.1.2.4.70") + dicom_elements(head) + fragments(0x7FE00010, all);
  };
  for (const int number : {1, 2}) EXPECT_EQ(image(file(twice), number).pixels.at<std::uint16_t>(3, 1), 301);
  twice[3][0] = '\0';
  expect_refused(file(twice),
                 "x.dcm: does not say which of its 6 parts of compressed pixels make up a frame; convert it");
}

// The stored values by gdcmconv --raw and numpy are 1113 and 1120 in the middle, 30 and 47 beside it.
TEST_F(DicomSound, RealSlicesWithCompressedIconsAreRead) {
  MARROW_NEED_DATA(folder, "strangers/icons");
  const marrow::Volume volume = marrow::files::read_volume_file(folder, {});
  ASSERT_EQ(volume.grid.size, (std::array<int, 3>{512, 512, 2}));
  EXPECT_EQ(volume.at(256, 256, 0), 1113 - 1024);
  EXPECT_EQ(volume.at(256, 256, 1), 1120 - 1024);
  EXPECT_EQ(volume.at(300, 200, 0), 30 - 1024);
  EXPECT_EQ(volume.at(300, 200, 1), 47 - 1024);
}

}  // namespace dicom_sound_test
