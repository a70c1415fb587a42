// SPDX-License-Identifier: Apache-2.0
// X-ray images in files whose names say little, or something else than their content.
#include <gtest/gtest.h>

#include "tests/plugins/read/dicom_text.hpp"
#include "tests/plugins/read/files.hpp"
#include "tests/plugins/read/itk_files.hpp"
#include "tests/plugins/read/reading.hpp"

namespace image_formats_test {

using marrow::test::bytes_of;
using marrow::test::ItkGrid;
using marrow::test::little;
using marrow::test::put;
using marrow::test::TemporaryFolder;
using marrow::test::with;
using marrow::test::write_itk;
using Path = std::filesystem::path;

class ImageFormats : public testing::Test {
 protected:
  cv::Mat read(const std::string& name, int frame = 0) {
    warnings.clear();
    marrow::Context::Hooks hooks;
    hooks.log = [&](std::string_view text, marrow::LogLevel) { warnings += std::string(text) + "\n"; };
    return marrow::test::read_by<marrow::Image>("read.image", folder / name, {{"frame", std::int64_t{frame}}},
                                                marrow::Context(hooks))
        .pixels;
  }
  marrow::Volume volume(const std::string& name) {
    return marrow::test::read_by<marrow::Volume>("read.volume", folder / name);
  }
  void expect_warned(const std::string& text) { EXPECT_NE(warnings.find(text), std::string::npos) << warnings; }
  TemporaryFolder folder;
  std::string warnings;
};

bool are_equal(const cv::Mat& one, const cv::Mat& other) {
  return one.type() == other.type() && one.size() == other.size() && cv::norm(one, other, cv::NORM_INF) == 0;
}

template <class T>
ItkGrid<T> ramp(std::vector<unsigned> size, double step) {
  ItkGrid<T> grid{.size = size};
  std::size_t count = 1;
  for (const unsigned length : size) count *= length;
  for (std::size_t i = 0; i < count; ++i) grid.samples.push_back(T(double(i) * step));
  return grid;
}

/// The bytes of a text of hexadecimal digits.
std::string from_hex(const std::string& digits) {
  std::string bytes;
  for (std::size_t i = 0; i < digits.size(); i += 2) bytes += char(std::stoi(digits.substr(i, 2), nullptr, 16));
  return bytes;
}

// 16 x 8 grey pixels, written by Pillow 9.4 with quality 100. Pillow reads 50 in the left half and 200 in the right
// one.
const std::string kJpeg = from_hex(
    "ffd8ffe000104a46494600010100000100010000ffdb0043000101010101010101010101010101010101010101010101010101010101010101"
    "0101010101010101010101010101010101010101010101010101010101010101ffc0000b080008001001011100ffc400150001010000000000"
    "0000000000000000000a0bffc40014100100000000000000000000000000000000ffda0008010100003f0031ea583fffd9");

TEST_F(ImageFormats, TheContentTellsTheFormatWhateverTheName) {
  write_itk(folder / "a.png", ramp<std::uint16_t>({7, 5}, 1801));
  write_itk(folder / "a.tif", ramp<std::uint16_t>({7, 5}, 1801));
  write_itk(folder / "a.mha", ramp<std::uint16_t>({7, 5}, 1801));
  write_itk(folder / "a.nrrd", ramp<std::uint16_t>({7, 5}, 1801));
  write_itk(folder / "a.nii.gz", ramp<std::uint16_t>({7, 5}, 1801));
  put(folder / "a.dcm", marrow::test::dicom_file(marrow::test::fluoroscopy()));
  for (const char* name : {"a.png", "a.tif", "a.mha", "a.nrrd", "a.nii.gz", "a.dcm"}) {
    const cv::Mat right = read(name);
    for (const char* other : {"IM000001", "a.IMA", "a.jpg", "a.img", "of.tif", "of.dcm", "of.png"}) {
      std::filesystem::copy_file(folder / name, folder / other, std::filesystem::copy_options::overwrite_existing);
      EXPECT_TRUE(are_equal(read(other), right)) << name << " as " << other;
    }
  }
}

TEST_F(ImageFormats, FilesForVolumesHoldImagesToo) {
  for (const char* name : {"a.mha", "a.nrrd", "a.nii", "a.nii.gz"}) {
    write_itk(folder / name, ramp<std::uint8_t>({7, 5}, 3));
    EXPECT_EQ(read(name).type(), CV_8U) << name;
    EXPECT_EQ(read(name).at<std::uint8_t>(1, 2), (7 + 2) * 3) << name << ": row 1, column 2";
    write_itk(folder / name, ramp<std::uint16_t>({7, 5}, 1801));
    EXPECT_EQ(read(name).at<std::uint16_t>(4, 6), 34 * 1801) << name;
    write_itk(folder / name, ramp<std::int16_t>({7, 5}, -100));
    EXPECT_EQ(read(name).type(), CV_32F) << name;
    EXPECT_EQ(read(name).at<float>(4, 6), -3400) << name;
    write_itk(folder / name, ramp<std::uint8_t>({7, 5, 2}, 3));
    EXPECT_EQ(read(name, 2).at<std::uint8_t>(0, 1), (35 + 1) * 3) << name << ": the second slice";
    EXPECT_SAYS(read(name), "has 2 pages; an image has one");
  }
  write_itk(folder / "signed.tif", ramp<std::int16_t>({7, 5}, -100));
  EXPECT_EQ(read("signed.tif").at<float>(4, 6), -3400);
  read("a.nii", 1);
  expect_warned(
      "a.nii: NIfTI does not say which row of an image is the upper one; the first that is stored is taken as the "
      "upper one, as ITK writes it: compare it with the anatomy, or save it as PNG");
  read("a.mha", 1);
  EXPECT_EQ(warnings, "");
}

TEST_F(ImageFormats, JpegIsReadAndCalledLossy) {
  for (const char* name : {"a.jpg", "a.jpeg", "a.JPG", "a"}) {
    put(folder / name, kJpeg);
    const cv::Mat pixels = read(name);
    ASSERT_EQ(pixels.type(), CV_8U);
    ASSERT_EQ(pixels.size(), cv::Size(16, 8));
    EXPECT_EQ(pixels.at<std::uint8_t>(7, 7), 50);
    EXPECT_EQ(pixels.at<std::uint8_t>(7, 8), 200);
    expect_warned(std::string(name) +
                  ": was compressed with loss (JPEG or the like): grey levels are changed a little, most where edges "
                  "are, and may have lost bits; use the device's own file where there is one");
  }
  put(folder / "cut.jpg", kJpeg.substr(0, kJpeg.size() - 6));
  EXPECT_SAYS(read("cut.jpg"), "cut.jpg: cannot be read as JPEG, it may be cut off or damaged");
  const std::string size("\xFF\xC0\0\x0B\x08\0\x08\0\x10", 9);
  put(folder / "bits.jpg", with(kJpeg, size, std::string("\xFF\xC1\0\x0B\x0C\0\x08\0\x10", 9)));
  EXPECT_SAYS(read("bits.jpg"), "bits.jpg: is a JPEG of 12 bits, of which only those of 8 are read; save it as PNG");
  put(folder / "kind.jpg", with(kJpeg, size, std::string("\xFF\xC3\0\x0B\x08\0\x08\0\x10", 9)));
  EXPECT_SAYS(read("kind.jpg"), "kind.jpg: is a JPEG of a kind that is not read (lossless, or with arithmetic coding)");
  // APP1 with Exif: one entry, Orientation (274) = 3.
  const std::string exif =
      std::string("Exif\0\0", 6) + std::string("II*\0\x08\0\0\0\x01\0\x12\x01\x03\0\x01\0\0\0\x03\0\0\0\0\0\0\0", 26);
  put(folder / "turned.jpg",
      kJpeg.substr(0, 2) + "\xFF\xE1" + std::string(1, '\0') + char(exif.size() + 2) + exif + kJpeg.substr(2));
  EXPECT_SAYS(read("turned.jpg"), "turned.jpg: is to be shown turned or mirrored (Exif Orientation 3)");
}

TEST_F(ImageFormats, LossyDicomIsCalledSo) {
  auto elements = marrow::test::fluoroscopy();
  put(folder / "x", marrow::test::dicom_file(elements));
  read("x");
  EXPECT_EQ(warnings, "");
  elements[0x00282110] = "CS:01";
  put(folder / "x", marrow::test::dicom_file(elements));
  read("x");
  expect_warned("x: was compressed with loss");
}

/// A BMP of 3 x 2 pixels: `rows` as they are stored, the lowest first if `height` is positive. The layout is that of
/// Microsoft's BITMAPFILEHEADER and BITMAPINFOHEADER.
std::string bmp(int bits, const std::string& rows, const std::string& palette = "", int height = 2, int method = 0) {
  const std::uint32_t pixels = 54 + std::uint32_t(palette.size());
  return "BM" + little(pixels + std::uint32_t(rows.size()), 4) + little(0, 4) + little(pixels, 4) + little(40, 4) +
         little(3, 4) + little(std::uint32_t(height), 4) + little(1, 2) + little(std::uint32_t(bits), 2) +
         little(std::uint32_t(method), 4) + little(std::uint32_t(rows.size()), 4) + std::string(16, '\0') + palette +
         rows;
}

TEST_F(ImageFormats, BmpAsFrameGrabbersWriteIt) {
  using namespace std::string_literals;
  std::string grey;  // the usual palette
  for (int i = 0; i < 256; ++i) grey += std::string(3, char(i)) + '\0';
  const cv::Mat right = (cv::Mat_<std::uint8_t>(2, 3) << 10, 20, 30, 40, 50, 200);
  put(folder / "a.bmp", bmp(8, "\x28\x32\xC8\0\x0A\x14\x1E\0"s, grey));
  EXPECT_TRUE(are_equal(read("a.bmp"), right));
  put(folder / "down.bmp", bmp(8, "\x0A\x14\x1E\0\x28\x32\xC8\0"s, grey, -2));
  EXPECT_TRUE(are_equal(read("down.bmp"), right)) << "a negative height: the upper row is the first";
  std::string turned;  // a palette from white to black
  for (int i = 0; i < 256; ++i) turned += std::string(3, char(255 - i)) + '\0';
  put(folder / "turned.bmp", bmp(8, "\x28\x32\xC8\0\x0A\x14\x1E\0"s, turned));
  EXPECT_TRUE(are_equal(read("turned.bmp"), 255 - right));
  put(folder / "24.bmp",
      bmp(24, "\x28\x28\x28\x32\x32\x32\xC8\xC8\xC8\0\0\0\x0A\x0A\x0A\x14\x14\x14\x1E\x1E\x1E\0\0\0"s));
  EXPECT_TRUE(are_equal(read("24.bmp"), right));
  put(folder / "4.bmp", bmp(4, "\x01\x20\0\0\x21\0\0\0"s, "\0\0\0\0\x50\x50\x50\0\xFF\xFF\xFF\0"s));
  const cv::Mat three = (cv::Mat_<std::uint8_t>(2, 3) << 255, 80, 0, 0, 80, 255);
  EXPECT_TRUE(are_equal(read("4.bmp"), three));
  put(folder / "c.bmp",
      bmp(24, "\x28\x28\x28\x32\x32\x32\xC8\xC8\xC8\0\0\0\x0A\x0A\x0A\x01\x02\x03\x1E\x1E\x1E\0\0\0"s));
  EXPECT_SAYS(read("c.bmp"),
              "c.bmp: has colours: the pixel at column 2 of row 1 has red 3, green 2, blue 1; an X-ray image is grey: "
              "save it as grey levels");
  put(folder / "rle.bmp", bmp(8, "\x03\x0A\0\x01"s, grey, 2, 1));
  EXPECT_SAYS(read("rle.bmp"), "rle.bmp: is a BMP of 8 bits stored by method 1, which is not read; save it as PNG");
  put(folder / "none.bmp", bmp(8, "\x28\x32\xC8\0\x0A\x14\x1E\0"s, grey.substr(0, 100 * 4)));
  EXPECT_SAYS(read("none.bmp"), "none.bmp: is damaged: a pixel has the colour 200, which its palette does not have");
  const std::string whole = bmp(8, "\x28\x32\xC8\0\x0A\x14\x1E\0"s, grey);
  put(folder / "cut.bmp", whole.substr(0, whole.size() - 1));
  EXPECT_SAYS(read("cut.bmp"), "cut.bmp: is cut off or damaged: 1086 bytes expected, got 1085");
}

TEST_F(ImageFormats, EqualColoursAreGrey) {
  for (const char* name : {"a.png", "a.tif"})
    for (const unsigned components : {3u, 4u}) {
      ItkGrid<std::uint8_t> colours{.size = {3, 2}, .components = components};
      for (const int grey : {10, 20, 30, 40, 50, 200}) {
        colours.samples.insert(colours.samples.end(), 3, std::uint8_t(grey));
        if (components == 4) colours.samples.push_back(255);
      }
      write_itk(folder / name, colours);
      const cv::Mat right = (cv::Mat_<std::uint8_t>(2, 3) << 10, 20, 30, 40, 50, 200);
      EXPECT_TRUE(are_equal(read(name), right)) << name << " " << components;
      colours.samples[components * 4 + 1] = 49;
      write_itk(folder / name, colours);
      EXPECT_SAYS(read(name),
                  std::string(name) + ": has colours: the pixel at column 2 of row 2 has red 50, green 49, blue 50");
    }
  ItkGrid<std::uint16_t> deep{.size = {2, 1}, .samples = {999, 999, 999, 60000, 60000, 60000}, .components = 3};
  write_itk(folder / "deep.png", deep);
  EXPECT_EQ(read("deep.png").at<std::uint16_t>(0, 1), 60000);
  ItkGrid<std::uint8_t> glass{.size = {2, 1}, .samples = {9, 9, 9, 255, 8, 8, 8, 254}, .components = 4};
  write_itk(folder / "glass.png", glass);
  EXPECT_SAYS(read("glass.png"),
              "glass.png: is transparent in places: the pixel at column 2 of row 1 has the opacity 254, expected 255; "
              "save it without transparency (an alpha channel)");
}

TEST_F(ImageFormats, WhatIsNoImageIsNamed) {
  for (const auto& [content, words] :
       {std::pair{"GIF89a", "is a GIF picture, not an image that can be read; save it as PNG"},
        {"%PDF-1.4", "is a PDF document, not an image that can be read"},
        {"some text",
         "not an image that can be read; known are PNG, TIFF, JPEG, BMP, DICOM, MetaImage, NRRD and NIfTI"}}) {
    put(folder / "a", content);
    EXPECT_SAYS(read("a"), "a: " + std::string(words));
  }
}

TEST_F(ImageFormats, VolumesWhateverTheirNames) {
  for (const char* name : {"v.mha", "v.nrrd", "v.nii", "v.nii.gz"}) {
    write_itk(folder / name, ramp<std::int16_t>({4, 3, 5}, 7));
    const marrow::Volume right = volume(name);
    for (const char* other : {"v", "v.img", "v.dcm", "v.tif", "v.gz"}) {
      std::filesystem::copy_file(folder / name, folder / other, std::filesystem::copy_options::overwrite_existing);
      EXPECT_EQ(marrow::hash_of(volume(other)), marrow::hash_of(right)) << name << " as " << other;
    }
  }
  put(folder / "x.nii", kJpeg);
  EXPECT_SAYS(volume("x.nii"), "x.nii: is a picture (PNG, JPEG or BMP), not a volume that can be read; known are .mha");
  put(folder / "slice", marrow::test::dicom_file(marrow::test::fluoroscopy()));
  EXPECT_SAYS(volume("slice"), "slice: is one DICOM file; a volume is a folder of DICOM slices (name the folder)");
}

// The mirror of an X-ray image that faces the patient is undone because of its header, not because of its name.
TEST_F(ImageFormats, DicomWithoutAnEndingIsMirroredBack) {
  auto elements = marrow::test::fluoroscopy();
  elements[0x00200020] = "CS:R\\F";
  put(folder / "x.dcm", marrow::test::dicom_file(elements));
  put(folder / "x", marrow::test::dicom_file(elements));
  EXPECT_TRUE(are_equal(read("x"), read("x.dcm")));
}

}  // namespace image_formats_test
