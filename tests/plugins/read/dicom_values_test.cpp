// SPDX-License-Identifier: Apache-2.0
// What the header of a DICOM file says about its values: in different places, and missing.
#include <gtest/gtest.h>

#include "marrow/toolbox/files/volume_file.hpp"
#include "tests/plugins/read/dicom_text.hpp"
#include "tests/plugins/read/files.hpp"

namespace dicom_values_test {

using namespace marrow::test;

Elements with(Elements elements, const Elements& changed) {
  for (const auto& [tag, value] : changed) elements[tag] = value;
  return elements;
}

Elements without(Elements elements, std::uint32_t tag) {
  elements.erase(tag);
  return elements;
}

class DicomValues : public testing::Test {
 protected:
  marrow::Image image(const std::string& bytes, int frame = 0) {
    put(folder / "x.dcm", bytes);
    return marrow::files::read_image_file(folder / "x.dcm", frame);
  }
  /// Three slices, the second one as given.
  marrow::Volume series(const Elements& second, const Elements& others = {}) {
    std::filesystem::create_directories(folder / "ct");
    for (int z = 0; z < 3; ++z) put(folder / ("ct/s" + std::to_string(z)), dicom_file(with(ct_slice(z), others)));
    put(folder / "ct/s1", dicom_file(second));
    return marrow::files::read_volume_file(folder / "ct", {});
  }
  TemporaryFolder folder;
};

/// The sequence that describes each frame, for three frames whose values are to be multiplied by 1, 5 and 7.
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
  const Elements both =
      with(three_frames(), {{0x00281052, "DS:0"}, {0x00281053, "DS:1"}, {0x52009230, slopes(dicom_elements)}});
  EXPECT_EQ(image(dicom_file(both), 3).pixels.at<float>(3, 1), 7 * 301 + 2);
}

// A guess in its place could turn bone into air, or a negative value into a high one.
TEST_F(DicomValues, WithoutWhatThePixelsAreAreRefused) {
  for (const auto& [tag, name] : {std::pair{0x00280002u, "SamplesPerPixel (0028,0002)"},
                                  {0x00280100u, "BitsAllocated (0028,0100)"},
                                  {0x00280101u, "BitsStored (0028,0101)"},
                                  {0x00280102u, "HighBit (0028,0102)"},
                                  {0x00280103u, "PixelRepresentation (0028,0103)"}}) {
    EXPECT_SAYS(image(dicom_file(without(fluoroscopy(), tag))), std::string("x.dcm: its header has no ") + name);
    EXPECT_SAYS(series(without(ct_slice(1), tag)), std::string("s1: its header has no ") + name);
  }
}

TEST_F(DicomValues, OfAnUnknownPhotometryAreRefused) {
  EXPECT_SAYS(image(dicom_file(without(fluoroscopy(), 0x00280004))),
              "PhotometricInterpretation (0028,0004) is missing");
  for (const char* other : {"MONOCHROME3", "RGB"})
    EXPECT_SAYS(image(dicom_file(with(fluoroscopy(), {{0x00280004, std::string("CS:") + other}}))),
                std::string("(0028,0004) is '") + other + "'; expected MONOCHROME1 or MONOCHROME2");
}

TEST_F(DicomValues, OfSlicesWithOtherPixelsAreRefused) {
  EXPECT_SAYS(series(with(ct_slice(1), {{0x00280103, "US:1"}})), "s1: its pixels have 16 bits with a sign, those of");
  EXPECT_SAYS(series(with(ct_slice(1), {{0x00280101, "US:12"}, {0x00280102, "US:11"}})),
              "s1: its pixels have 12 bits without a sign, those of");
}

// Their SeriesInstanceUID and positions would fit together.
TEST_F(DicomValues, OfTwoPatientsOrPlacesAreNotJoined) {
  const Elements all{{0x00100020, "LO:x"}, {0x0020000D, "UI:1.2.1"}, {0x00200052, "UI:1.2.2"}};
  EXPECT_EQ(series(with(ct_slice(1), all), all).grid.size[2], 3);
  for (const auto& [tag, value, name] : {std::tuple{0x00100020u, "LO:other", "PatientID (0010,0020)"},
                                         {0x0020000Du, "UI:1.2.9", "StudyInstanceUID (0020,000d)"},
                                         {0x00200052u, "UI:1.2.9", "FrameOfReferenceUID (0020,0052)"}})
    EXPECT_SAYS(series(with(with(ct_slice(1), all), {{tag, value}}), all),
                std::string("s1: has another ") + name + " than ");
}

// Raw stored values look like Hounsfield units that are 1024 too high.
TEST_F(DicomValues, OfACtThatDoesNotScaleThemAreRefused) {
  for (const auto& [tag, name] :
       {std::pair{0x00281052u, "RescaleIntercept (0028,1052)"}, {0x00281053u, "RescaleSlope (0028,1053)"}}) {
    series(ct_slice(1));
    for (int z = 0; z < 3; ++z) put(folder / ("ct/s" + std::to_string(z)), dicom_file(without(ct_slice(z), tag)));
    EXPECT_SAYS(marrow::files::read_volume_file(folder / "ct", {}),
                std::string("s0: its header has no ") + name + ", nor has any other slice's");
  }
  EXPECT_EQ(image(dicom_file(fluoroscopy())).pixels.at<std::uint16_t>(3, 1), 301) << "an X-ray image needs no scale";
}

// Outside the scanned region, a scanner writes any value; here it is above that of any bone.
TEST_F(DicomValues, OfPaddingAreAir) {
  const auto with_pixel = [](Elements slice, std::uint32_t value) {
    slice[0x7FE00010].replace(3, 2, little(value, 2));
    return slice;
  };
  const Elements padded = with_pixel(with(ct_slice(1), {{0x00280120, "US:63536"}}), 63536);
  marrow::Volume volume = series(padded);
  EXPECT_EQ(volume.at(0, 0, 1), -1000);
  EXPECT_EQ(volume.at(1, 0, 1), 1 - 1024);
  volume = series(with_pixel(with(padded, {{0x00280121, "US:65000"}}), 64000));
  EXPECT_EQ(volume.at(0, 0, 1), -1000) << "a range of values";
  volume = series(with_pixel(padded, 63537));
  EXPECT_EQ(volume.at(0, 0, 1), 63537 - 1024) << "only the padding itself";
  volume = series(with(ct_slice(1), {{0x00280120, "US:3"}}));
  EXPECT_EQ(volume.at(3, 0, 1), 3 - 1024) << "below air already";
  // If pixels have a sign, the padding value has one too, but it may be written without.
  const Elements with_sign{{0x00280103, "US:1"}, {0x00281052, "DS:0"}, {0x00281053, "DS:-1"}};
  for (const char* value : {"SS:-2000", "US:63536"}) {
    volume = series(with_pixel(with(with(ct_slice(1), with_sign), {{0x00280120, value}}), 63536), with_sign);
    EXPECT_EQ(volume.at(0, 0, 1), -1000) << value;
  }
}

TEST_F(DicomValues, OfPaddingThatTheirBitsCannotHoldAreRefused) {
  const Elements bits{{0x00280101, "US:12"}, {0x00280102, "US:11"}};
  Elements slice = with(with(ct_slice(1), bits), {{0x00280120, "US:63536"}});
  EXPECT_EQ(series(slice, bits).at(0, 0, 1), -1024) << "none is there";
  slice[0x7FE00010].replace(3, 2, little(63536, 2));
  EXPECT_SAYS(series(slice, bits), "s1: has pixels of the value 63536 (PixelPaddingValue), which the 12 bits");
}

// Air must come out bright. The fluoroscopy holds 0 at its first pixel and 305 at its last.
TEST_F(DicomValues, AreInvertedByWhatTheSignSaysOfStoredOnes) {
  const auto rises = [&](const Elements& changed) {
    cv::Mat pixels;
    image(dicom_file(with(fluoroscopy(), changed))).pixels.convertTo(pixels, CV_32F);
    return pixels.at<float>(0, 0) < pixels.at<float>(3, 5);
  };
  const std::pair<std::uint32_t, std::string> less{0x00281041, "SS:-1"}, more{0x00281041, "SS:1"},
      slope{0x00281053, "DS:-1"}, intercept{0x00281052, "DS:4095"}, white{0x00280004, "CS:MONOCHROME1"};
  EXPECT_TRUE(rises({}));
  EXPECT_TRUE(rises({more}));
  EXPECT_FALSE(rises({less}));
  EXPECT_FALSE(rises({less, slope, intercept})) << "the slope has turned them round already";
  EXPECT_TRUE(rises({more, slope, intercept}));
  EXPECT_FALSE(rises({white})) << "without a sign, as a viewer shows it";
  EXPECT_TRUE(rises({white, more})) << "the sign says what a viewer's white does not";
  EXPECT_SAYS(image(dicom_file(with(fluoroscopy(), {{0x00281041, "SS:0"}}))), "(0028,1041) is 0, expected 1 or -1");
}

TEST_F(DicomValues, ThatAreLogarithmsAreRefused) {
  EXPECT_SAYS(image(dicom_file(with(fluoroscopy(), {{0x00281040, "CS:LOG"}}))),
              "x.dcm: its values are logarithms (PixelIntensityRelationship (0028,1040) is LOG)");
  EXPECT_EQ(image(dicom_file(with(fluoroscopy(), {{0x00281040, "CS:LIN"}}))).pixels.at<std::uint16_t>(3, 1), 301);
}

TEST_F(DicomValues, OfOtherThanEveryFrameAreRefused) {
  const Elements two = with(three_frames(), {{0x52009230, slopes(dicom_elements, 2)}});
  EXPECT_SAYS(image(dicom_file(two), 3), "it has 3 frames, but values for 2 (PerFrameFunctionalGroupsSequence)");
}

}  // namespace dicom_values_test
