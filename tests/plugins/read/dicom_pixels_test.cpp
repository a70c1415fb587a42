// SPDX-License-Identifier: Apache-2.0
// Pixels of DICOM files in every transfer syntax that is read. Damaged ones are refused by name, never decoded to
// something else; sound ones that are unusual, or not read, are not called damaged.
#include <sys/stat.h>

#include "marrow/toolbox/files/volume_file.hpp"
#include "tests/plugins/read/damage.hpp"
#include "tests/plugins/read/dicom_text.hpp"
#include "tests/plugins/read/itk_files.hpp"

namespace dicom_pixels_test {

using namespace marrow;
using namespace marrow::test;
using namespace std::string_literals;

/// A frontal fluoroscopy of 48 x 32 pixels, grey values that rise and fall, of 8 or 16 bits.
Elements image_of(int bits) {
  std::string pixels;
  for (int v = 0; v < 32; ++v)
    for (int u = 0; u < 48; ++u) {
      const int ripple = u < 8 ? 0 : (u * 37 + v * v * 11) % (bits == 8 ? 90 : 3000);
      pixels += little(std::uint32_t(20 + v * 3 + ripple), bits / 8);
    }
  const std::string stored = "US:" + std::to_string(bits), highest = "US:" + std::to_string(bits - 1);
  Elements changes =
      elements_of("00280010 US:32 00280011 US:48 00280100 " + stored + " 00280101 " + stored + " 00280102 " + highest);
  changes[0x7FE00010] = (bits == 8 ? "OB:" : "OW:") + pixels;
  return but(fluoroscopy(), changes);
}

const std::string kRows = dicom_element(0x00280010, "US", little(32, 2));
const std::string kJpeg57 = "1.2.840.10008.1.2.4.57", kRle = "1.2.840.10008.1.2.5";
const std::string kLossless[] = {kRle, kJpeg57, "1.2.840.10008.1.2.4.70", "1.2.840.10008.1.2.4.80",
                                 "1.2.840.10008.1.2.4.90"};

class DicomPixels : public InAFolder {
 protected:
  Image image(const std::string& bytes, int frame = 0) {
    put(folder / "x.dcm", bytes);
    return files::read_image_file(folder / "x.dcm", frame);
  }
  int pixel_of(const std::string& bytes, int frame = 0) { return image(bytes, frame).pixels.at<std::uint16_t>(3, 1); }
  std::string compressed(const Elements& elements, const std::string& syntax) {
    put(folder / "plain.dcm", dicom_file(elements));
    compress_dicom(folder / "plain.dcm", folder / "packed.dcm", syntax);
    return bytes_of(folder / "packed.dcm");
  }
  void expect(const std::string& bytes, const std::string& text) { EXPECT_REFUSED(image(bytes), "x.dcm", text); }
  void expect_sound(const std::string& bytes, const std::string& text) {
    const std::string said = refusal_within_limits([&] { image(bytes); }, "x.dcm");
    EXPECT_HAS(said, text);
    EXPECT_EQ(said.find("damaged"), std::string::npos) << said;
    EXPECT_EQ(said.find("cut off"), std::string::npos) << said;
  }
};

double greatest_difference(const Image& one, const Image& other) {
  return one.pixels.type() == other.pixels.type() ? cv::norm(one.pixels, other.pixels, cv::NORM_INF) : 1e9;
}

TEST_F(DicomPixels, EverySyntaxGivesTheSamePixels) {
  for (const int bits : {8, 16})
    for (const std::string& syntax : kLossless)
      EXPECT_EQ(greatest_difference(image(compressed(image_of(bits), syntax)), image(dicom_file(image_of(bits)))), 0)
          << syntax << " " << bits;
  cv::Mat difference;  // baseline JPEG is near
  cv::absdiff(image(compressed(image_of(8), "1.2.840.10008.1.2.4.50")).pixels, image(dicom_file(image_of(8))).pixels,
              difference);
  EXPECT_LT(cv::mean(difference)[0], 12);
}

// Whatever is changed in compressed pixels, they are refused or come out as other pixels: there is no checksum.
TEST_F(DicomPixels, DamagedCompressedOnes) {
  for (const int bits : {8, 16})
    for (const std::string& syntax : kLossless) {
      const std::string good = compressed(image_of(bits), syntax);
      int refused = 0;
      for (int i = 0; i < 16; ++i) {
        std::string bytes = good, said;
        const std::size_t at = bytes.size() - 9 - std::size_t(i * 7919 * 3) % (bytes.size() * 2 / 3 - 100);
        bytes[at] = char(bytes[at] ^ (1 << i % 8));
        const Outcome outcome = outcome_of([&] { image(bytes); }, "x.dcm", 64 << 20, said);
        EXPECT_TRUE(outcome == Outcome::refused || outcome == Outcome::accepted)
            << syntax << ": " << name_of(outcome) << ": " << said;
        refused += outcome == Outcome::refused;
      }
      EXPECT_GT(refused, 0) << syntax << " " << bits;
    }
}

TEST_F(DicomPixels, CompressedOnesOfAnotherSizeOrKind) {
  for (const std::string& syntax : kLossless) {
    const std::string good = compressed(image_of(16), syntax);
    for (const int lie : {33, 31, 60000})
      expect(with(good, kRows, dicom_element(0x00280010, "US", little(std::uint32_t(lie), 2))),
             "x.dcm: is cut off or damaged");
    if (syntax != kRle)
      expect(with(good, syntax, "1.2.840.10008.1.2.4.92"),
             "is written in the transfer syntax 1.2.840.10008.1.2.4.92 (JPEG 2000 part 2 lossless), which is not read, "
             "nor does gdcmconv; export it again without compression (explicit VR little endian)");
  }
  const std::string jpeg = compressed(image_of(16), kJpeg57);
  for (const char* end : {"50", "51", "80", "90"})
    expect(with(jpeg, kJpeg57, "1.2.840.10008.1.2.4."s + end), "another kind of JPEG than the header says");
  expect(with(jpeg, kJpeg57, "1.2.840.10008.1.2.1\0\0\0"s), "its pixels are not written as its transfer syntax says");
}

TEST_F(DicomPixels, OtherTransferSyntaxesAreRefusedWithWhatToDo) {
  const auto in_syntax = [](const std::string& uid) {
    return std::string(128, '\0') + "DICM" + dicom_element(0x00020010, "UI", uid) + dicom_elements(image_of(16));
  };
  expect(in_syntax("1.2.840.10008.1.2.4.93"),
         "is written in the transfer syntax 1.2.840.10008.1.2.4.93 (JPEG 2000 part 2), which is not read, nor does "
         "gdcmconv; export it again without compression (explicit VR little endian)");
  for (const char* uid : {"1.2.840.10008.1.2.4.201", "1.2.840.10008.1.2.4.202"})
    expect(in_syntax(uid), "(high-throughput JPEG 2000 lossless), which is not read, nor does gdcmconv");
  expect(in_syntax("1.2.840.10008.1.2.4.203"), "(high-throughput JPEG 2000), which is not read, nor does gdcmconv");
  expect(in_syntax("1.2.3.4"), "1.2.3.4 (unknown), which is not read; convert it: gdcmconv --raw IN OUT");
  expect(in_syntax("x"), "does not say how it is written");
}

TEST_F(DicomPixels, KindsOfValuesThatThereAreNot) {
  const std::string modality("\x08\0\x60\0", 4);
  for (const char* kind : {"XX", "DX", "cs", "UX"})
    expect(with(dicom_file(image_of(16)), modality + "CS", modality + kind), "an element is of an unknown kind");
}

TEST_F(DicomPixels, BytesInWordsOfTheOtherOrder) {
  const auto turned = [](std::size_t number, int width) {
    const std::string bytes = little(number, width);
    return std::string(bytes.rbegin(), bytes.rend());
  };
  const auto file = [&](const std::string& pixels) {
    std::string bytes = dicom_start("1.2.840.10008.1.2.2");
    for (const auto& [tag, text] :
         but(elements_of(
                 "00080060 CS:XA 00280004 CS:MONOCHROME2 00280002 US:1 00280010 US:2 00280011 US:2 00280100 US:8 "
                 "00280101 US:8 00280102 US:7 00280103 US:0"),
             {{0x7FE00010, pixels}})) {
      const std::string kind = text.substr(0, 2);
      std::string value = kind == "US" ? turned(std::size_t(std::stoi(text.substr(3))), 2) : text.substr(3);
      if (value.size() % 2) value += ' ';
      bytes += turned(tag >> 16, 2) + turned(tag & 0xFFFF, 2) + kind +
               (kind[0] == 'O' ? little(0, 2) + turned(value.size(), 4) : turned(value.size(), 2)) + value;
    }
    return bytes;
  };
  EXPECT_EQ(image(file("OB:\1\2\3\4")).pixels.at<std::uint8_t>(0, 1), 2);
  const cv::Mat words = image(file("OW:\1\2\3\4")).pixels;
  EXPECT_EQ(words.at<std::uint8_t>(0, 1), 1);
  EXPECT_EQ(words.at<std::uint8_t>(1, 0), 4);
}

TEST_F(DicomPixels, BitsThatContradictEachOtherOrAreNotStored) {
  const auto changed = [](std::uint32_t tag, const std::string& value) {
    return dicom_file(but(image_of(16), {{tag, value}}));
  };
  expect(changed(0x00280100, "US:12"), "its pixels have 16 of 12 bits");
  expect(changed(0x00280101, "US:17"), "its pixels have 17 of 16 bits");
  expect(changed(0x00280101, "US:0"), "its pixels have 0 of 16 bits");
  expect(changed(0x00280102, "US:7"), "the highest being 7");
  expect(changed(0x00280103, "US:2"), "PixelRepresentation (0028,0103) is neither 0 nor 1");
  expect(changed(0x00280008, "IS:99999"), "bytes of pixels, but there are");
  expect(changed(0x00281053, "DS:0"), "RescaleSlope (0028,1053) is 0");
  expect(changed(0x00280004, "CS:PALETTE COLOR"), "its pixels are numbers of colours in a table");
  expect(with(dicom_file(image_of(16)), kRows, kRows + kRows), "gives the element (0028,0010) twice");
  Elements elements = but(fluoroscopy(), {{0x00280101, "US:12"}, {0x00280102, "US:11"}});
  std::string& pixels = elements[0x7FE00010];
  for (std::size_t i = 4; i < pixels.size(); i += 2) pixels[i] = char(pixels[i] | 0x70);  // an overlay
  EXPECT_EQ(pixel_of(dicom_file(elements)), 301);
}

// A row of black is packed to nothing: 60000 x 60000 pixels in some kilobytes.
TEST_F(DicomPixels, FramesThatClaimMoreThanTheyCanHold) {
  Elements elements = but(without(image_of(8), {0x7FE00010}), {{0x00280010, "US:60000"}, {0x00280011, "US:60000"}});
  std::string coded = little(1, 4) + little(64, 4) + std::string(56, '\0');
  for (int i = 0; i < 20000; ++i) coded += "\x81\0"s;
  expect(dicom_start(kRle) + dicom_elements(elements) + dicom_fragments(0x7FE00010, {coded}),
         "its header claims 60000 x 60000 x 1 samples, but the file has only");
}

TEST_F(DicomPixels, PipesAndEmptyFiles) {
  for (const char* name : {"a.dcm", "a.png"}) {
    ASSERT_EQ(::mkfifo((folder / name).c_str(), 0600), 0);
    EXPECT_REFUSED(files::read_image_file(folder / name), name, "expected a file, this is none");
  }
  expect("", "the file is empty");
}

// The icon stands in a sequence before the pixels; both may hold any fragments.
TEST_F(DicomPixels, CompressedIconsAreSteppedOver) {
  for (const std::uint32_t tag : {0x00091001u, 0x7FE00010u}) {  // of a maker, and the icon's own pixels
    const std::string icon = dicom_fragments(tag, {"some", "\xFE\xFF\xDD\xE0"});
    const std::string bytes = dicom_start("1.2.840.10008.1.2.1") +
                              dicom_elements(without(fluoroscopy(), {0x7FE00010})) +
                              dicom_elements({{0x00880200, dicom_items({icon})}}) +
                              dicom_elements({{0x7FE00010, fluoroscopy().at(0x7FE00010)}});
    EXPECT_EQ(pixel_of(bytes), 301) << tag;
    EXPECT_SAYS(image(bytes.substr(0, bytes.find("some") + 4)), "x.dcm: is cut off or damaged");
  }
  // The stored values by gdcmconv --raw and numpy are 1113 and 1120 in the middle, 30 and 47 beside it.
  MARROW_NEED_DATA(folder, "strangers/icons");
  const Volume volume = files::read_volume_file(folder, {});
  ASSERT_EQ(volume.grid.size, (std::array<int, 3>{512, 512, 2}));
  EXPECT_EQ(volume.at(256, 256, 0), 1113 - 1024);
  EXPECT_EQ(volume.at(256, 256, 1), 1120 - 1024);
  EXPECT_EQ(volume.at(300, 200, 0), 30 - 1024);
  EXPECT_EQ(volume.at(300, 200, 1), 47 - 1024);
}

TEST_F(DicomPixels, SoundFilesThatAreNotReadAreNotCalledDamaged) {
  const Elements bits_8{{0x00280100, "US:8"}, {0x00280101, "US:8"}, {0x00280102, "US:7"}};
  // A pixel of 8 bits is the number of a colour, so 24 pixels take 24 bytes.
  Elements coloured = but(bits_8, {{0x00280004, "CS:PALETTE COLOR"}, {0x7FE00010, "OB:" + std::string(24, '\1')}});
  expect_sound(
      dicom_file(but(fluoroscopy(), coloured)),
      "x.dcm: its pixels are numbers of colours in a table (PhotometricInterpretation (0028,0004) is PALETTE COLOR), "
      "not grey levels; export it as MONOCHROME2");
  // Four pixels share a colour, so a pixel has 1.5 values on average.
  coloured = but(
      bits_8, {{0x00280002, "US:3"}, {0x00280004, "CS:YBR_PARTIAL_420"}, {0x7FE00010, "OB:" + std::string(36, '\1')}});
  expect_sound(dicom_file(but(fluoroscopy(), coloured)), "x.dcm: has 3 channels");
  expect_sound(dicom_file({{0x00080060, "CS:SR"}}),
               "x.dcm: holds no image, it is of modality SR; expected a CT slice or an X-ray image");
  expect_sound(dicom_file({{0x00081030, "LO:a study"}}), "x.dcm: holds no image; expected a CT slice");
  expect_sound(dicom_file(but(fluoroscopy(), {{0x00280101, "US:12"}})),
               "x.dcm: its pixels have 12 of 16 bits, the highest being 15, which is not read; expected 8, 16 or 32 "
               "bits, the highest being the last that is stored: export it with 16");
  expect_sound(dicom_file(but(fluoroscopy(), elements_of("00280100 US:1 00280101 US:1 00280102 US:0"))),
               "x.dcm: its pixels have 1 of 1 bits");
}

// Some programs write the kind of an element although the transfer syntax excludes it, or leave it out; some leave out
// the file's start.
TEST_F(DicomPixels, ElementsAreReadAsTheFirstOneIsWritten) {
  EXPECT_EQ(pixel_of(dicom_start("1.2.840.10008.1.2.1") + implicit_elements(fluoroscopy())), 301);
  EXPECT_EQ(pixel_of(dicom_start("1.2.840.10008.1.2") + dicom_elements(fluoroscopy())), 301);
  const Elements all = but(fluoroscopy(), {{0x00080005, "CS:ISO_IR 100"}});
  EXPECT_EQ(pixel_of(dicom_elements(all)), 301);
  EXPECT_EQ(pixel_of(implicit_elements(all)), 301);
}

/// The one compressed frame of a file: what stands between the table of offsets and the end.
std::string compressed_frame(const std::string& bytes) {
  const auto length_at = [&](std::size_t at) {
    return std::size_t(std::uint8_t(bytes[at])) | std::size_t(std::uint8_t(bytes[at + 1])) << 8;
  };
  const std::size_t table = bytes.find("\xE0\x7F\x10\0OB"s) + 12, item = table + 8 + length_at(table + 4);
  return bytes.substr(item + 8, length_at(item + 4));
}

// Two frames in three fragments each, without a table of offsets. GDCM compressed the frame.
TEST_F(DicomPixels, FramesInSeveralFragmentsNeedNoTableOfOffsets) {
  const std::string syntax = "1.2.840.10008.1.2.4.70",
                    frame = compressed_frame(compressed(but(fluoroscopy(), {{0x00080018, "UI:1.2.3"}}), syntax));
  ASSERT_GT(frame.size(), 8u);
  ASSERT_EQ(frame.substr(0, 2), "\xFF\xD8");
  std::vector<std::string> twice;
  for (int i = 0; i < 2; ++i) twice.insert(twice.end(), {frame.substr(0, 4), frame.substr(4, 2), frame.substr(6)});
  const std::string start =
      dicom_start(syntax) + dicom_elements(without(but(fluoroscopy(), {{0x00280008, "IS:2"}}), {0x7FE00010}));
  for (const int number : {1, 2}) EXPECT_EQ(pixel_of(start + dicom_fragments(0x7FE00010, twice), number), 301);
  twice[3][0] = '\0';
  expect_sound(start + dicom_fragments(0x7FE00010, twice),
               "x.dcm: does not say which of its 6 parts of compressed pixels make up a frame; convert it");
}

}  // namespace dicom_pixels_test
