// SPDX-License-Identifier: Apache-2.0
// What the header of a DICOM file says about its values: in different places, and missing; and images in which higher
// values mean less radiation.
#include "marrow/toolbox/files/sequence_files.hpp"
#include "marrow/toolbox/files/volume_file.hpp"
#include "tests/plugins/read/dicom_text.hpp"

namespace dicom_values_test {

using namespace marrow;
using namespace marrow::test;

class DicomValues : public InAFolder {
 protected:
  Image image(const Elements& elements, int frame = 0) { return image_of(dicom_file(elements), frame); }
  Image image_of(const std::string& bytes, int frame = 0) {
    put(folder / "x.dcm", bytes);
    return files::read_image_file(folder / "x.dcm", frame);
  }
  /// Three slices, the second one as given.
  Volume series(const Elements& second, const Elements& others = {}) {
    for (int z = 0; z < 3; ++z)
      put(folder / ("ct/s" + std::to_string(z)), dicom_file(z == 1 ? second : but(ct_slice(z), others)));
    return files::read_volume_file(folder / "ct", {});
  }
};

/// The sequence that describes each frame, for three frames whose values are to be multiplied by 1, 5 and 7.
std::string slopes(std::string (*write)(const Elements&), std::size_t count = 3) {
  std::vector<std::string> frames;
  for (const char* slope : {"DS:1", "DS:5", "DS:7"})
    if (frames.size() < count)
      frames.push_back(write({{0x00289145, dicom_items({write({{0x00281052, "DS:2"}, {0x00281053, slope}})})}}));
  return dicom_items(frames);
}
Elements three_frames(const Elements& more) {
  const std::string pixels = fluoroscopy().at(0x7FE00010);
  return but(but(fluoroscopy(), more),
             {{0x00280008, "IS:3"}, {0x7FE00010, pixels + pixels.substr(3) + pixels.substr(3)}});
}

TEST_F(DicomValues, OfEachFrameInEveryWayOfWritingThem) {
  const Elements implicit = three_frames({{0x52009230, slopes(implicit_elements)}});
  const std::pair<const char*, std::string> ways[] = {
      {"explicit", dicom_file(three_frames({{0x52009230, slopes(dicom_elements)}}))},
      {"implicit", implicit_file(implicit)},
      {"of an unknown kind", dicom_file(but(implicit, {{0x52009230, "UN" + implicit.at(0x52009230).substr(2)}}))}};
  for (const auto& [name, bytes] : ways)
    for (const auto& [frame, slope] : {std::pair{1, 1.f}, {2, 5.f}, {3, 7.f}}) {
      const Image read = image_of(bytes, frame);
      ASSERT_EQ(read.pixels.type(), CV_32F) << name << " " << frame;
      EXPECT_EQ(read.pixels.at<float>(3, 1), slope * 301 + 2) << name << " " << frame;
    }
}

TEST_F(DicomValues, OfAFrameComeBeforeThoseOfTheFile) {
  const Elements both =
      three_frames({{0x00281052, "DS:0"}, {0x00281053, "DS:1"}, {0x52009230, slopes(dicom_elements)}});
  EXPECT_EQ(image(both, 3).pixels.at<float>(3, 1), 7 * 301 + 2);
  EXPECT_SAYS(image(three_frames({{0x52009230, slopes(dicom_elements, 2)}}), 3),
              "it has 3 frames, but values for 2 (PerFrameFunctionalGroupsSequence)");
}

// A guess in its place could turn bone into air, or a negative value into a high one.
TEST_F(DicomValues, WithoutWhatThePixelsAreAreRefused) {
  for (const auto& [tag, name] : {std::pair{0x00280002u, "SamplesPerPixel (0028,0002)"},
                                  {0x00280100u, "BitsAllocated (0028,0100)"},
                                  {0x00280101u, "BitsStored (0028,0101)"},
                                  {0x00280102u, "HighBit (0028,0102)"},
                                  {0x00280103u, "PixelRepresentation (0028,0103)"}}) {
    EXPECT_SAYS(image(without(fluoroscopy(), {tag})), std::string("x.dcm: its header has no ") + name);
    EXPECT_SAYS(series(without(ct_slice(1), {tag})), std::string("s1: its header has no ") + name);
  }
}

TEST_F(DicomValues, OfAnUnknownPhotometryOrOfSlicesWithOtherPixelsAreRefused) {
  EXPECT_SAYS(image(without(fluoroscopy(), {0x00280004})), "PhotometricInterpretation (0028,0004) is missing");
  for (const std::string other : {"MONOCHROME3", "RGB"})
    EXPECT_SAYS(image(but(fluoroscopy(), {{0x00280004, "CS:" + other}})),
                "(0028,0004) is '" + other + "'; expected MONOCHROME1 or MONOCHROME2");
  EXPECT_SAYS(series(but(ct_slice(1), {{0x00280103, "US:1"}})), "s1: its pixels have 16 bits with a sign, those of");
  EXPECT_SAYS(series(but(ct_slice(1), {{0x00280101, "US:12"}, {0x00280102, "US:11"}})),
              "s1: its pixels have 12 bits without a sign, those of");
}

// Their SeriesInstanceUID and positions would fit together.
TEST_F(DicomValues, OfTwoPatientsOrPlacesAreNotJoined) {
  const Elements all{{0x00100020, "LO:x"}, {0x0020000D, "UI:1.2.1"}, {0x00200052, "UI:1.2.2"}};
  EXPECT_EQ(series(but(ct_slice(1), all), all).grid.size[2], 3);
  for (const auto& [tag, value, name] : {std::tuple{0x00100020u, "LO:other", "PatientID (0010,0020)"},
                                         {0x0020000Du, "UI:1.2.9", "StudyInstanceUID (0020,000d)"},
                                         {0x00200052u, "UI:1.2.9", "FrameOfReferenceUID (0020,0052)"}})
    EXPECT_SAYS(series(but(but(ct_slice(1), all), {{tag, value}}), all),
                std::string("s1: has another ") + name + " than ");
}

// Raw stored values look like Hounsfield units that are 1024 too high.
TEST_F(DicomValues, OfACtThatDoesNotScaleThemAreRefused) {
  for (const auto& [tag, name] :
       {std::pair{0x00281052u, "RescaleIntercept (0028,1052)"}, {0x00281053u, "RescaleSlope (0028,1053)"}}) {
    series(ct_slice(1));
    for (int z = 0; z < 3; ++z) put(folder / ("ct/s" + std::to_string(z)), dicom_file(without(ct_slice(z), {tag})));
    EXPECT_SAYS(files::read_volume_file(folder / "ct", {}),
                std::string("s0: its header has no ") + name + ", nor has any other slice's");
  }
  EXPECT_EQ(image(fluoroscopy()).pixels.at<std::uint16_t>(3, 1), 301) << "an X-ray image needs no scale";
}

// Outside the scanned region, a scanner writes any value; here it is above that of any bone.
TEST_F(DicomValues, OfPaddingAreAir) {
  const auto with_pixel = [](Elements slice, std::uint32_t value) {
    slice[0x7FE00010].replace(3, 2, little(value, 2));
    return slice;
  };
  const Elements padded = with_pixel(but(ct_slice(1), {{0x00280120, "US:63536"}}), 63536);
  const Volume volume = series(padded);
  EXPECT_EQ(volume.at(0, 0, 1), -1000);
  EXPECT_EQ(volume.at(1, 0, 1), 1 - 1024);
  const auto first = [&](const Elements& second, const Elements& others = {}) {
    return series(second, others).at(0, 0, 1);
  };
  EXPECT_EQ(first(with_pixel(but(padded, {{0x00280121, "US:65000"}}), 64000)), -1000) << "a range of values";
  EXPECT_EQ(first(with_pixel(padded, 63537)), 63537 - 1024) << "only the padding itself";
  EXPECT_EQ(series(but(ct_slice(1), {{0x00280120, "US:3"}})).at(3, 0, 1), 3 - 1024) << "below air already";
  // If pixels have a sign, the padding value has one too, but it may be written without.
  const Elements with_sign{{0x00280103, "US:1"}, {0x00281052, "DS:0"}, {0x00281053, "DS:-1"}};
  for (const char* value : {"SS:-2000", "US:63536"})
    EXPECT_EQ(first(with_pixel(but(but(ct_slice(1), with_sign), {{0x00280120, value}}), 63536), with_sign), -1000)
        << value;
  // Of padding that the bits cannot hold.
  const Elements bits{{0x00280101, "US:12"}, {0x00280102, "US:11"}};
  const Elements slice = but(but(ct_slice(1), bits), {{0x00280120, "US:63536"}});
  EXPECT_EQ(first(slice, bits), -1024) << "none is there";
  EXPECT_SAYS(series(with_pixel(slice, 63536), bits),
              "s1: has pixels of the value 63536 (PixelPaddingValue), which the 12 bits");
}

const Elements kWhite{{0x00280004, "CS:MONOCHROME1"}}, kLess{{0x00281041, "SS:-1"}}, kMore{{0x00281041, "SS:1"}};

// Air must come out bright. The fluoroscopy holds 0 at its first pixel and 305 at its last.
TEST_F(DicomValues, AreInvertedByWhatTheSignSaysOfStoredOnesAndLogarithmsAreRefused) {
  const auto rises = [&](const Elements& changed) {
    cv::Mat pixels;
    image(but(fluoroscopy(), changed)).pixels.convertTo(pixels, CV_32F);
    return pixels.at<float>(0, 0) < pixels.at<float>(3, 5);
  };
  const Elements turned{{0x00281053, "DS:-1"}, {0x00281052, "DS:4095"}};
  EXPECT_TRUE(rises({}));
  EXPECT_TRUE(rises(kMore));
  EXPECT_FALSE(rises(kLess));
  EXPECT_FALSE(rises(but(kLess, turned))) << "the slope has turned them round already";
  EXPECT_TRUE(rises(but(kMore, turned)));
  EXPECT_FALSE(rises(kWhite)) << "without a sign, as a viewer shows it";
  EXPECT_TRUE(rises(but(kWhite, kMore))) << "the sign says what a viewer's white does not";
  EXPECT_SAYS(image(but(fluoroscopy(), {{0x00281041, "SS:0"}})), "(0028,1041) is 0, expected 1 or -1");
  EXPECT_SAYS(image(but(fluoroscopy(), {{0x00281040, "CS:LOG"}})),
              "x.dcm: its values are logarithms (PixelIntensityRelationship (0028,1040) is LOG)");
  EXPECT_EQ(image(but(fluoroscopy(), {{0x00281040, "CS:LIN"}})).pixels.at<std::uint16_t>(3, 1), 301);
}

// Images in which higher values mean less radiation are inverted within the range of their stored bits. So the right
// value of a pixel p of 12 bits is 4095 - p, whatever the other pixels of the frame are.
class DicomPolarity : public DicomValues {
 protected:
  using Pair = std::array<double, 2>;
  /// Two frames of 3 x 2 pixels that differ only in the last pixel.
  static Elements two_frames(int bits_stored, std::uint32_t last, std::uint32_t last_of_second, const Elements& by) {
    const int width = bits_stored > 8 ? 2 : 1;
    const std::string bits = std::to_string(bits_stored), highest = std::to_string(bits_stored - 1);
    Elements changes = elements_of("00280008 IS:2 00280010 US:2 00280011 US:3 00280101 US:" + bits +
                                   " 00280102 US:" + highest + " 00280100 US:" + std::to_string(8 * width));
    changes[0x7FE00010] = width == 2 ? "OW:" : "OB:";
    for (const std::uint32_t end : {last, last_of_second})
      for (const std::uint32_t value : {5u, 100u, 7u, 8u, 9u, end}) changes[0x7FE00010] += little(value, width);
    return but(but(fluoroscopy(), changes), by);
  }
  /// The pixel (column 1, row 0) of both frames, which is stored as 100.
  Pair second_pixels(const Elements& elements) {
    Pair values{};
    for (const int frame : {0, 1}) {
      cv::Mat pixels;
      image(elements, frame + 1).pixels.convertTo(pixels, CV_64F);
      values[std::size_t(frame)] = pixels.at<double>(0, 1);
    }
    return values;
  }
};

TEST_F(DicomPolarity, IsTurnedWithinTheStoredBitsNotByTheFramesMaximum) {
  for (const Elements& turned : {kWhite, kLess}) {
    EXPECT_EQ(second_pixels(two_frames(12, 200, 3000, turned)), (Pair{4095 - 100, 4095 - 100}));
    EXPECT_EQ(second_pixels(two_frames(8, 101, 255, turned)), (Pair{255 - 100, 255 - 100}));
    EXPECT_EQ(second_pixels(two_frames(16, 101, 65535, turned)), (Pair{65535 - 100, 65535 - 100}));
  }
  EXPECT_EQ(second_pixels(two_frames(12, 200, 3000, {})), (Pair{100, 100}));
  // 12 bits with a sign hold -2048 to 2047, which is turned into itself: p becomes -1 - p.
  EXPECT_EQ(second_pixels(two_frames(12, 200, 4000, but(kWhite, {{0x00280103, "US:1"}}))), (Pair{-101, -101}));
  // The scaled values are those of the turned pixel: 2 * (4095 - 100) + 10.
  const Elements scaled = but(kLess, {{0x00281052, "DS:10"}, {0x00281053, "DS:2"}});
  EXPECT_EQ(second_pixels(two_frames(12, 200, 3000, scaled)), (Pair{8000, 8000}));
}

TEST_F(DicomPolarity, KeepsTheTypeOfThePixelsAndOfMoreBitsThanAFloatHoldsIsRefused) {
  EXPECT_EQ(image(two_frames(12, 200, 3000, kWhite), 1).pixels.type(), CV_16U);
  for (const Image& image : files::read_image_frames(folder / "x.dcm", {}))
    EXPECT_EQ(image.pixels.at<std::uint16_t>(0, 1), 3995);
  Elements bits_32 = elements_of("00280010 US:1 00280011 US:1 00280100 US:32 00280101 US:32 00280102 US:31");
  bits_32[0x7FE00010] = "OW:" + little(100, 4);
  EXPECT_SAYS(image(but(fluoroscopy(), but(kWhite, bits_32))),
              "x.dcm: dark is air in this image of 32 bits, and such pixels are inverted up to 24 bits only; export it "
              "with 16 bits");
}

// The right values are 4095 minus what pydicom reads at this pixel, 3407 and 3375.
TEST_F(DicomPolarity, IsTheSameInEachRealFrame) {
  MARROW_NEED_DATA(path, "strangers/polarity/b12_mono1_two.dcm");
  EXPECT_EQ(files::read_image_file(path, 1).pixels.at<std::uint16_t>(300, 300), 688);
  EXPECT_EQ(files::read_image_file(path, 2).pixels.at<std::uint16_t>(300, 300), 720);
}

}  // namespace dicom_values_test
