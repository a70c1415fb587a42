// SPDX-License-Identifier: Apache-2.0
// X-ray images and CT slices in every transfer syntax that is read, and damaged ones: refused by name, never decoded to
// something else.
#include <gtest/gtest.h>
#include <sys/stat.h>

#include "marrow/toolbox/files/volume_file.hpp"
#include "marrow/toolbox/files/xray_header.hpp"
#include "tests/plugins/read/dicom_text.hpp"
#include "tests/plugins/read/files.hpp"
#include "tests/plugins/read/hostile.hpp"
#include "tests/plugins/read/itk_files.hpp"

namespace hostile_images_test {

using namespace marrow::test;
using namespace std::string_literals;
using Path = std::filesystem::path;

marrow::Image image_at(const Path& path) { return marrow::files::read_image_file(path); }

/// A frontal fluoroscopy of 48 x 32 pixels, grey values that rise and fall, of 8 or 16 bits.
Elements image_of(int bits) {
  Elements elements = fluoroscopy();
  std::string pixels;
  for (int v = 0; v < 32; ++v)
    for (int u = 0; u < 48; ++u) {
      const int ripple = u < 8 ? 0 : (u * 37 + v * v * 11) % (bits == 8 ? 90 : 3000);
      pixels += little(std::uint32_t(20 + v * 3 + ripple), bits / 8);
    }
  elements[0x00280010] = "US:32";
  elements[0x00280011] = "US:48";
  elements[0x00280100] = elements[0x00280101] = "US:" + std::to_string(bits);
  elements[0x00280102] = "US:" + std::to_string(bits - 1);
  elements[0x7FE00010] = (bits == 8 ? "OB:" : "OW:") + pixels;
  return elements;
}

struct Compressed {
  const char* name;
  const char* uid;
};
constexpr Compressed kLossless[] = {{"rle", "1.2.840.10008.1.2.5"},
                                    {"jpeg57", "1.2.840.10008.1.2.4.57"},
                                    {"jpeg70", "1.2.840.10008.1.2.4.70"},
                                    {"jpegls", "1.2.840.10008.1.2.4.80"},
                                    {"jpeg2000", "1.2.840.10008.1.2.4.90"}};

std::string bytes_of_image(const marrow::Image& image) {
  return {reinterpret_cast<const char*>(image.pixels.data), image.pixels.total() * image.pixels.elemSize()};
}

class HostileDicom : public testing::Test {
 protected:
  void expect(const std::string& bytes, const std::string& text) {
    put(folder / "x.dcm", bytes);
    EXPECT_REFUSED(image_at(folder / "x.dcm"), "x.dcm", text);
  }
  std::string compressed(int bits, const Compressed& how) {
    put(folder / "plain.dcm", dicom_file(image_of(bits)));
    compress_dicom(folder / "plain.dcm", folder / "packed.dcm", how.uid);
    return bytes_of(folder / "packed.dcm");
  }
  TemporaryFolder folder;
};

TEST_F(HostileDicom, EveryLosslessSyntaxGivesTheSamePixels) {
  for (const int bits : {8, 16})
    for (const Compressed& how : kLossless) {
      compressed(bits, how);
      EXPECT_EQ(bytes_of_image(image_at(folder / "packed.dcm")), bytes_of_image(image_at(folder / "plain.dcm")))
          << how.name << " " << bits;
    }
}

TEST_F(HostileDicom, BaselineJpegIsNear) {
  compressed(8, {"jpeg50", "1.2.840.10008.1.2.4.50"});
  cv::Mat difference;
  cv::absdiff(image_at(folder / "packed.dcm").pixels, image_at(folder / "plain.dcm").pixels, difference);
  EXPECT_LT(cv::mean(difference)[0], 12);
}

// Whatever is changed in compressed pixels, they are refused or come out as other pixels: there is no checksum.
TEST_F(HostileDicom, DamagedCompressedPixels) {
  for (const int bits : {8, 16})
    for (const Compressed& how : kLossless) {
      const std::string good = compressed(bits, how);
      int refused = 0;
      for (int i = 0; i < 16; ++i) {
        std::string bytes = good;
        const std::size_t at = bytes.size() - 9 - std::size_t(i * 7919 * 3) % (bytes.size() * 2 / 3 - 100);
        bytes[at] = char(bytes[at] ^ (1 << i % 8));
        put(folder / "x.dcm", bytes);
        std::string said;
        const Outcome outcome = outcome_of([&] { image_at(folder / "x.dcm"); }, "x.dcm", 64 << 20, said);
        EXPECT_TRUE(outcome == Outcome::refused || outcome == Outcome::accepted)
            << how.name << ": " << name_of(outcome) << ": " << said;
        refused += outcome == Outcome::refused;
      }
      EXPECT_GT(refused, 0) << how.name << " " << bits;
    }
}

TEST_F(HostileDicom, CompressedPixelsOfAnotherSizeOrKind) {
  for (const Compressed& how : kLossless) {
    const std::string good = compressed(16, how);
    const std::string rows = dicom_element(0x00280010, "US", little(32, 2));
    for (const int lie : {33, 31, 60000}) {
      put(folder / "x.dcm", with(good, rows, dicom_element(0x00280010, "US", little(std::uint32_t(lie), 2))));
      EXPECT_REFUSED(image_at(folder / "x.dcm"), "x.dcm", "x.dcm: is cut off or damaged");
    }
    if (std::string(how.name) != "rle")
      expect(with(good, std::string(how.uid), "1.2.840.10008.1.2.4.92"),
             "is written in the transfer syntax 1.2.840.10008.1.2.4.92 (JPEG 2000 part 2 lossless), which is not read, "
             "nor does gdcmconv; export it again without compression (explicit VR little endian)");
  }
  const std::string jpeg = compressed(16, kLossless[1]);
  for (const char* other :
       {"1.2.840.10008.1.2.4.50", "1.2.840.10008.1.2.4.51", "1.2.840.10008.1.2.4.80", "1.2.840.10008.1.2.4.90"})
    expect(with(jpeg, "1.2.840.10008.1.2.4.57", other), "another kind of JPEG than the header says");
  expect(with(jpeg, "1.2.840.10008.1.2.4.57", "1.2.840.10008.1.2.1\0\0\0"s),
         "its pixels are not written as its transfer syntax says");
}

TEST_F(HostileDicom, OtherTransferSyntaxesAreRefusedWithWhatToDo) {
  const std::string good = dicom_file(image_of(16));
  const std::string rest = good.substr(good.find(std::string("\x08\0\x16\0UI", 6)));
  const auto in_syntax = [&](const std::string& uid) {
    return std::string(128, '\0') + "DICM" + dicom_element(0x00020010, "UI", uid) + rest;
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

TEST_F(HostileDicom, KindsOfValuesThatThereAreNot) {
  const std::string good = dicom_file(image_of(16));
  for (const char* kind : {"XX", "DX", "cs", "UX"})
    expect(with(good, std::string("\x08\0\x60\0", 4) + "CS", std::string("\x08\0\x60\0", 4) + kind),
           "an element is of an unknown kind");
}

TEST_F(HostileDicom, BytesInWordsOfTheOtherOrder) {
  const auto big = [](std::uint32_t tag, const std::string& kind, std::string value) {
    const auto turned = [](std::uint32_t number, int width) {
      const std::string bytes = little(number, width);
      return std::string(bytes.rbegin(), bytes.rend());
    };
    if (kind == "US") value = turned(std::uint32_t(std::stoi(value)), 2);
    if (value.size() % 2) value += ' ';
    return turned(tag >> 16, 2) + turned(tag & 0xFFFF, 2) + kind +
           (kind[0] == 'O' ? std::string(2, '\0') + turned(std::uint32_t(value.size()), 4)
                           : turned(std::uint32_t(value.size()), 2)) +
           value;
  };
  const auto file = [&](const std::string& kind) {
    const std::string meta = dicom_element(0x00020010, "UI", "1.2.840.10008.1.2.2");
    std::string bytes = std::string(128, '\0') + "DICM" +
                        dicom_element(0x00020000, "UL", little(std::uint32_t(meta.size()), 4)) + meta +
                        big(0x00080060, "CS", "XA") + big(0x00280004, "CS", "MONOCHROME2");
    for (const auto& [tag, value] : {std::pair{0x00280002u, "1"},
                                     {0x00280010u, "2"},
                                     {0x00280011u, "2"},
                                     {0x00280100u, "8"},
                                     {0x00280101u, "8"},
                                     {0x00280102u, "7"},
                                     {0x00280103u, "0"}})
      bytes += big(tag, "US", value);
    return bytes + big(0x7FE00010, kind, "\1\2\3\4");
  };
  put(folder / "a.dcm", file("OB"));
  EXPECT_EQ(image_at(folder / "a.dcm").pixels.at<std::uint8_t>(0, 1), 2);
  put(folder / "a.dcm", file("OW"));
  EXPECT_EQ(image_at(folder / "a.dcm").pixels.at<std::uint8_t>(0, 1), 1);
  EXPECT_EQ(image_at(folder / "a.dcm").pixels.at<std::uint8_t>(1, 0), 4);
}

TEST_F(HostileDicom, BitsThatContradictEachOther) {
  const auto changed = [&](std::uint32_t tag, const std::string& value) {
    Elements elements = image_of(16);
    elements[tag] = value;
    return dicom_file(elements);
  };
  expect(changed(0x00280100, "US:12"), "its pixels have 16 of 12 bits");
  expect(changed(0x00280101, "US:17"), "its pixels have 17 of 16 bits");
  expect(changed(0x00280101, "US:0"), "its pixels have 0 of 16 bits");
  expect(changed(0x00280102, "US:7"), "the highest being 7");
  expect(changed(0x00280103, "US:2"), "PixelRepresentation (0028,0103) is neither 0 nor 1");
  expect(changed(0x00280008, "IS:99999"), "bytes of pixels, but there are");
  expect(changed(0x00281053, "DS:0"), "RescaleSlope (0028,1053) is 0");
  expect(changed(0x00280004, "CS:PALETTE COLOR"), "its pixels are numbers of colours in a table");
  std::string twice = dicom_file(image_of(16));
  const std::string rows = dicom_element(0x00280010, "US", little(32, 2));
  expect(with(twice, rows, rows + rows), "gives the element (0028,0010) twice");
}

TEST_F(HostileDicom, BitsAboveThoseStoredDoNotCount) {
  Elements elements = fluoroscopy();
  elements[0x00280101] = "US:12";
  elements[0x00280102] = "US:11";
  std::string& pixels = elements[0x7FE00010];
  for (std::size_t i = 4; i < pixels.size(); i += 2) pixels[i] = char(pixels[i] | 0x70);  // an overlay
  put(folder / "x.dcm", dicom_file(elements));
  EXPECT_EQ(image_at(folder / "x.dcm").pixels.at<std::uint16_t>(3, 1), 301);
}

// A row of black is packed to nothing: 60000 x 60000 pixels in some kilobytes.
TEST_F(HostileDicom, FramesThatClaimMoreThanTheyCanHold) {
  Elements elements = image_of(8);
  elements.erase(0x7FE00010);
  elements[0x00280010] = elements[0x00280011] = "US:60000";
  std::string coded = little(1, 4) + little(64, 4) + std::string(56, '\0');
  for (int i = 0; i < 20000; ++i) coded += std::string("\x81\0", 2);
  const auto item = [](std::uint32_t tag, std::size_t length) {
    return little(tag >> 16, 2) + little(tag & 0xFFFF, 2) + little(std::uint32_t(length), 4);
  };
  std::string file = dicom_file(elements);
  file = with(file, "1.2.840.10008.1.2.1" + std::string(1, '\0'), "1.2.840.10008.1.2.5" + std::string(1, '\0'));
  file += little(0x7FE0, 2) + little(0x0010, 2) + "OB" + little(0, 2) + little(0xFFFFFFFFu, 4) + item(0xFFFEE000u, 0) +
          item(0xFFFEE000u, coded.size()) + coded + item(0xFFFEE0DDu, 0);
  expect(file, "its header claims 60000 x 60000 x 1 samples, but the file has only");
}

TEST_F(HostileDicom, PipesAndEmptyFiles) {
  for (const char* name : {"a.dcm", "a.png"}) {
    ASSERT_EQ(::mkfifo((folder / name).c_str(), 0600), 0);
    EXPECT_REFUSED(image_at(folder / name), name, "expected a file, this is none");
  }
  put(folder / "b.dcm", "");
  EXPECT_REFUSED(image_at(folder / "b.dcm"), "b.dcm", "the file is empty");
}

// The files that an audit found to crash or stall the readers, where they are at hand.
TEST(Damaged, FilesOfTheAudit) {
  MARROW_NEED_DATA(folder, "damaged");
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    const Path path = entry.path();
    if (path.extension() == ".dcm") EXPECT_REFUSED(image_at(path), path.filename(), "");
    if (path.extension() == ".nrrd") EXPECT_REFUSED(marrow::files::read_volume_file(path, {}), path.filename(), "");
  }
}

}  // namespace hostile_images_test
