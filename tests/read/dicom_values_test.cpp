// SPDX-License-Identifier: Apache-2.0
// What the header of a DICOM file says of its values: where it stands, and where it is missing.
#include <gtest/gtest.h>

#include "plugins/read/volume_file.hpp"
#include "read/dicom_text.hpp"
#include "read/files.hpp"

namespace {

using namespace marrow::test;

Elements with(Elements elements, const Elements& changed) {
  for (const auto& [tag, value] : changed) elements[tag] = value;
  return elements;
}

class DicomValues : public testing::Test {
 protected:
  marrow::Image image(const std::string& bytes, int frame = 0) {
    put(folder / "x.dcm", bytes);
    return marrow::read::read_image_file(folder / "x.dcm", frame);
  }
  TemporaryFolder folder;
};

/// Three frames whose values are to be multiplied by 1, 5 and 7: the sequence of what is said of each frame.
std::string slopes(std::string (*write)(const Elements&), std::size_t count = 3) {
  std::vector<std::string> frames;
  for (const char* slope : {"DS:1", "DS:5", "DS:7"})
    if (frames.size() < count)
      frames.push_back(write({{0x00289145, dicom_items({write({{0x00281052, "DS:2"}, {0x00281053, slope}})})}}));
  return dicom_items(frames);
}
Elements three_frames() {
  Elements elements = with(fluoroscopy(), {{0x00280008, "IS:3"}});
  const std::string pixels = elements[0x7FE00010].substr(3);
  elements[0x7FE00010] += pixels + pixels;
  return elements;
}

TEST_F(DicomValues, OfEachFrameInEveryWayOfWritingThem) {
  Elements of_unknown_kind = with(three_frames(), {{0x52009230, slopes(implicit_elements)}});
  of_unknown_kind[0x52009230].replace(0, 2, "UN");
  const std::pair<const char*, std::string> files[] = {
      {"explicit", dicom_file(with(three_frames(), {{0x52009230, slopes(dicom_elements)}}))},
      {"implicit", implicit_file(with(three_frames(), {{0x52009230, slopes(implicit_elements)}}))},
      {"of an unknown kind", dicom_file(of_unknown_kind)}};
  for (const auto& [name, bytes] : files)
    for (const auto& [frame, slope] : {std::pair{1, 1.f}, {2, 5.f}, {3, 7.f}}) {
      const marrow::Image read = image(bytes, frame);
      ASSERT_EQ(read.pixels.type(), CV_32F) << name << " " << frame;
      EXPECT_EQ(read.pixels.at<float>(3, 1), slope * 301 + 2) << name << " " << frame;
    }
}

TEST_F(DicomValues, OfAFrameComeBeforeThoseOfTheFile) {
  const Elements both = with(three_frames(), {{0x00281052, "DS:0"}, {0x00281053, "DS:1"}, {0x52009230, slopes(dicom_elements)}});
  EXPECT_EQ(image(dicom_file(both), 3).pixels.at<float>(3, 1), 7 * 301 + 2);
}

TEST_F(DicomValues, OfOtherThanEveryFrameAreRefused) {
  const Elements two = with(three_frames(), {{0x52009230, slopes(dicom_elements, 2)}});
  EXPECT_SAYS(image(dicom_file(two), 3), "it has 3 frames, but values for 2 (PerFrameFunctionalGroupsSequence)");
}

}  // namespace
