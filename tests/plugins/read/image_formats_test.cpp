// SPDX-License-Identifier: Apache-2.0
// X-ray images in files whose names say little, or something else than their content.
#include "tests/plugins/read/damage.hpp"
#include "tests/plugins/read/dicom_text.hpp"
#include "tests/plugins/read/itk_files.hpp"
#include "tests/plugins/read/reading.hpp"

namespace image_formats_test {

using namespace marrow;
using namespace marrow::test;
using namespace std::string_literals;

class ImageFormats : public InAFolder {
 protected:
  cv::Mat read(const std::string& name, int frame = 0) {
    cv::Mat pixels;
    warnings = said_by([&](const Context& context) {
      pixels = read_by<Image>("read.image", folder / name, {{"frame", std::int64_t{frame}}}, context).pixels;
    });
    return pixels;
  }
  cv::Mat of(const std::string& name, const std::string& bytes) {
    put(folder / name, bytes);
    return read(name);
  }
  template <class T>
  cv::Mat of(const std::string& name, const ItkGrid<T>& grid, int frame = 0) {
    write_itk(folder / name, grid);
    return read(name, frame);
  }
  Volume volume(const std::string& name) { return read_by<Volume>("read.volume", folder / name); }
  void expect_warned(const std::string& text) {
    std::string all;
    for (const std::string& line : warnings) all += line + "\n";
    EXPECT_HAS(all, text);
  }
  std::vector<std::string> warnings;
};

bool are_equal(const cv::Mat& one, const cv::Mat& other) {
  return one.type() == other.type() && one.size() == other.size() && cv::norm(one, other, cv::NORM_INF) == 0;
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

const std::filesystem::copy_options kOver = std::filesystem::copy_options::overwrite_existing;

TEST_F(ImageFormats, TheContentTellsTheFormatWhateverTheName) {
  put(folder / "a.dcm", dicom_file(fluoroscopy()));
  for (const std::string name : {"a.png", "a.tif", "a.mha", "a.nrrd", "a.nii.gz", "a.dcm"}) {
    const cv::Mat right = name == "a.dcm" ? read(name) : of(name, ramp<std::uint16_t>({7, 5}, 1801));
    for (const char* other : {"IM000001", "a.IMA", "a.jpg", "a.img", "of.tif", "of.dcm", "of.png"}) {
      std::filesystem::copy_file(folder / name, folder / other, kOver);
      EXPECT_TRUE(are_equal(read(other), right)) << name << " as " << other;
    }
  }
}

TEST_F(ImageFormats, FilesForVolumesHoldImagesToo) {
  for (const char* name : {"a.mha", "a.nrrd", "a.nii", "a.nii.gz"}) {
    const cv::Mat bytes = of(name, ramp<std::uint8_t>({7, 5}, 3));
    EXPECT_EQ(bytes.type(), CV_8U) << name;
    EXPECT_EQ(bytes.at<std::uint8_t>(1, 2), (7 + 2) * 3) << name << ": row 1, column 2";
    EXPECT_EQ(of(name, ramp<std::uint16_t>({7, 5}, 1801)).at<std::uint16_t>(4, 6), 34 * 1801) << name;
    const cv::Mat with_sign = of(name, ramp<std::int16_t>({7, 5}, -100));
    EXPECT_EQ(with_sign.type(), CV_32F) << name;
    EXPECT_EQ(with_sign.at<float>(4, 6), -3400) << name;
    EXPECT_EQ(of(name, ramp<std::uint8_t>({7, 5, 2}, 3), 2).at<std::uint8_t>(0, 1), (35 + 1) * 3)
        << name << ": the second slice";
    EXPECT_SAYS(read(name), "has 2 pages; an image has one");
  }
  EXPECT_EQ(of("signed.tif", ramp<std::int16_t>({7, 5}, -100)).at<float>(4, 6), -3400);
  read("a.nii", 1);
  expect_warned(
      "a.nii: NIfTI does not say which row of an image is the upper one; the first that is stored is taken as the "
      "upper one, as ITK writes it: compare it with the anatomy, or save it as PNG");
  read("a.mha", 1);
  EXPECT_TRUE(warnings.empty());
}

TEST_F(ImageFormats, JpegIsReadAndCalledLossyAsIsLossyDicom) {
  for (const std::string name : {"a.jpg", "a.jpeg", "a.JPG", "a"}) {
    const cv::Mat pixels = of(name, kJpeg);
    ASSERT_EQ(pixels.type(), CV_8U);
    ASSERT_EQ(pixels.size(), cv::Size(16, 8));
    EXPECT_EQ(pixels.at<std::uint8_t>(7, 7), 50);
    EXPECT_EQ(pixels.at<std::uint8_t>(7, 8), 200);
    expect_warned(name +
                  ": was compressed with loss (JPEG or the like): grey levels are changed a little, most where edges "
                  "are, and may have lost bits; use the device's own file where there is one");
  }
  // APP1 with Exif: one entry, Orientation (274) = 3.
  const std::string exif = "Exif\0\0"s + "II*\0\x08\0\0\0\x01\0\x12\x01\x03\0\x01\0\0\0\x03\0\0\0\0\0\0\0"s;
  const std::string app1 = "\xFF\xE1\0"s + char(exif.size() + 2) + exif, size = "\xFF\xC0\0\x0B\x08\0\x08\0\x10"s;
  expect_faults(folder / "a.jpg", kJpeg,
                {{"", kJpeg.substr(0, kJpeg.size() - 6), "a.jpg: cannot be read as JPEG, it may be cut off or damaged"},
                 {size, "\xFF\xC1\0\x0B\x0C\0\x08\0\x10"s,
                  "a.jpg: is a JPEG of 12 bits, of which only those of 8 are read; save it as PNG"},
                 {size, "\xFF\xC3\0\x0B\x08\0\x08\0\x10"s,
                  "a.jpg: is a JPEG of a kind that is not read (lossless, or with arithmetic coding)"},
                 {"", kJpeg.substr(0, 2) + app1 + kJpeg.substr(2),
                  "a.jpg: is to be shown turned or mirrored (Exif Orientation 3)"}},
                [&](const auto& path) { read(path.filename()); });
  of("x", dicom_file(fluoroscopy()));
  EXPECT_TRUE(warnings.empty());
  of("x", dicom_file(but(fluoroscopy(), {{0x00282110, "CS:01"}})));
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
  std::string grey, turned;  // the usual palette, and one from white to black
  for (int i = 0; i < 256; ++i) grey += std::string(3, char(i)) + '\0', turned += std::string(3, char(255 - i)) + '\0';
  const cv::Mat right = (cv::Mat_<std::uint8_t>(2, 3) << 10, 20, 30, 40, 50, 200);
  const std::string upwards = "\x28\x32\xC8\0\x0A\x14\x1E\0"s, downwards = "\x0A\x14\x1E\0\x28\x32\xC8\0"s;
  const std::string whole = bmp(8, upwards, grey);
  EXPECT_TRUE(are_equal(of("a.bmp", whole), right));
  EXPECT_TRUE(are_equal(of("down.bmp", bmp(8, downwards, grey, -2)), right)) << "a negative height: from above";
  EXPECT_TRUE(are_equal(of("turned.bmp", bmp(8, upwards, turned)), 255 - right));
  const std::string lower = "\x28\x28\x28\x32\x32\x32\xC8\xC8\xC8\0\0\0"s,
                    upper = "\x0A\x0A\x0A\x14\x14\x14\x1E\x1E\x1E\0\0\0"s;
  EXPECT_TRUE(are_equal(of("24.bmp", bmp(24, lower + upper)), right));
  const std::string four = bmp(4, "\x01\x20\0\0\x21\0\0\0"s, "\0\0\0\0\x50\x50\x50\0\xFF\xFF\xFF\0"s);
  EXPECT_TRUE(are_equal(of("4.bmp", four), (cv::Mat_<std::uint8_t>(2, 3) << 255, 80, 0, 0, 80, 255)));
  expect_faults(
      folder / "a.bmp", whole,
      {{"", bmp(24, lower + with(upper, "\x14\x14\x14", "\x01\x02\x03")),
        "a.bmp: has colours: the pixel at column 2 of row 1 has red 3, green 2, blue 1; an X-ray image is "
        "grey: save it as grey levels"},
       {"", bmp(8, "\x03\x0A\0\x01"s, grey, 2, 1),
        "a.bmp: is a BMP of 8 bits stored by method 1, which is not read; save it as PNG"},
       {"", bmp(8, upwards, grey.substr(0, 100 * 4)),
        "a.bmp: is damaged: a pixel has the colour 200, which its palette does not have"},
       {"", whole.substr(0, whole.size() - 1), "a.bmp: is cut off or damaged: 1086 bytes expected, got 1085"}},
      [&](const auto& path) { read(path.filename()); });
}

TEST_F(ImageFormats, EqualColoursAreGrey) {
  for (const std::string name : {"a.png", "a.tif"})
    for (const unsigned components : {3u, 4u}) {
      ItkGrid<std::uint8_t> colours{.size = {3, 2}, .components = components};
      for (const int grey : {10, 20, 30, 40, 50, 200}) {
        colours.samples.insert(colours.samples.end(), 3, std::uint8_t(grey));
        if (components == 4) colours.samples.push_back(255);
      }
      EXPECT_TRUE(are_equal(of(name, colours), (cv::Mat_<std::uint8_t>(2, 3) << 10, 20, 30, 40, 50, 200)))
          << name << " " << components;
      colours.samples[components * 4 + 1] = 49;
      EXPECT_SAYS(of(name, colours),
                  name + ": has colours: the pixel at column 2 of row 2 has red 50, green 49, blue 50");
    }
  const ItkGrid<std::uint16_t> deep{.size = {2, 1}, .samples = {999, 999, 999, 60000, 60000, 60000}, .components = 3};
  EXPECT_EQ(of("deep.png", deep).at<std::uint16_t>(0, 1), 60000);
  const ItkGrid<std::uint8_t> glass{.size = {2, 1}, .samples = {9, 9, 9, 255, 8, 8, 8, 254}, .components = 4};
  EXPECT_SAYS(of("glass.png", glass),
              "glass.png: is transparent in places: the pixel at column 2 of row 1 has the opacity 254, expected 255; "
              "save it without transparency (an alpha channel)");
}

TEST_F(ImageFormats, WhatIsNoImageIsNamed) {
  EXPECT_SAYS(of("a", "GIF89a"), "a: is a GIF picture, not an image that can be read; save it as PNG");
  EXPECT_SAYS(of("a", "%PDF-1.4"), "a: is a PDF document, not an image that can be read");
  EXPECT_SAYS(of("a", "some text"),
              "a: not an image that can be read; known are PNG, TIFF, JPEG, BMP, DICOM, MetaImage, NRRD and NIfTI");
}

TEST_F(ImageFormats, VolumesAndDicomWhateverTheirNames) {
  for (const char* name : {"v.mha", "v.nrrd", "v.nii", "v.nii.gz"}) {
    write_itk(folder / name, ramp<std::int16_t>({4, 3, 5}, 7));
    const Volume right = volume(name);
    for (const char* other : {"v", "v.img", "v.dcm", "v.tif", "v.gz"}) {
      std::filesystem::copy_file(folder / name, folder / other, kOver);
      EXPECT_EQ(hash_of(volume(other)), hash_of(right)) << name << " as " << other;
    }
  }
  put(folder / "x.nii", kJpeg);
  EXPECT_SAYS(volume("x.nii"), "x.nii: is a picture (PNG, JPEG or BMP), not a volume that can be read; known are .mha");
  put(folder / "slice", dicom_file(fluoroscopy()));
  EXPECT_SAYS(volume("slice"), "slice: is one DICOM file; a volume is a folder of DICOM slices (name the folder)");
  // The mirror of an X-ray image that faces the patient is undone because of its header, not because of its name.
  const std::string bytes = dicom_file(but(fluoroscopy(), {{0x00200020, "CS:R\\F"}}));
  EXPECT_TRUE(are_equal(of("x", bytes), of("x.dcm", bytes)));
}

}  // namespace image_formats_test
