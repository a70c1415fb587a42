// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <zlib.h>

#include "tests/plugins/read/dicom_text.hpp"
#include "tests/plugins/read/files.hpp"
#include "tests/plugins/read/itk_files.hpp"
#include "tests/plugins/read/reading.hpp"

namespace image_test {

using marrow::test::ItkGrid;
using marrow::test::TemporaryFolder;
using marrow::test::write_itk;

marrow::Image read(const std::filesystem::path& path, int frame = 0) {
  return marrow::test::read_by<marrow::Image>("read.image", path, {{"frame", std::int64_t{frame}}});
}

template <class T>
ItkGrid<T> ramp(unsigned width, unsigned height, double step) {
  ItkGrid<T> grid{.size = {width, height}};
  for (unsigned i = 0; i < width * height; ++i) grid.samples.push_back(T(i * step));
  return grid;
}

TEST(ReadImage, IsTurnedOverWhereThatIsAskedFor) {
  const TemporaryFolder folder;
  write_itk(folder / "a.png", ramp<std::uint8_t>(7, 5, 1));
  const auto turned = [&](const std::string& mirror) {
    return marrow::test::read_by<marrow::Image>("read.image", folder / "a.png", {{"mirror", mirror}}).pixels;
  };
  EXPECT_EQ(turned("none").at<std::uint8_t>(1, 2), 7 + 2);
  EXPECT_EQ(turned("left_right").at<std::uint8_t>(1, 7 - 1 - 2), 7 + 2);
  EXPECT_EQ(turned("upside_down").at<std::uint8_t>(5 - 1 - 1, 2), 7 + 2);
}

TEST(ReadImage, KeepsBitsAndOrientation) {
  const TemporaryFolder folder;
  for (const char* name : {"a.png", "a.tif"}) {
    write_itk(folder / name, ramp<std::uint8_t>(7, 5, 3));
    const cv::Mat pixels = read(folder / name).pixels;
    ASSERT_EQ(pixels.type(), CV_8U);
    ASSERT_EQ(pixels.size(), cv::Size(7, 5));
    EXPECT_EQ(pixels.at<std::uint8_t>(1, 2), (7 + 2) * 3) << name << ": row 1, column 2 from the top left";
  }
  for (const char* name : {"b.png", "b.tif"}) {
    write_itk(folder / name, ramp<std::uint16_t>(7, 5, 1801));
    const cv::Mat pixels = read(folder / name).pixels;
    ASSERT_EQ(pixels.type(), CV_16U);
    EXPECT_EQ(pixels.at<std::uint16_t>(4, 6), 34 * 1801) << name;
  }
  write_itk(folder / "c.tif", ramp<float>(7, 5, 0.125));
  EXPECT_EQ(read(folder / "c.tif").pixels.at<float>(4, 6), 34 * 0.125f);
}

TEST(ReadImage, RealFluoroscopy) {
  for (const char* name :
       {"wrist/images/xr_rad_uln_cam01_UND.0002.tif", "wrist/images/xr_rad_uln_cam02_UND.0158.tif"}) {
    MARROW_NEED_DATA(path, name);
    const cv::Mat pixels = read(path).pixels;
    EXPECT_EQ(pixels.type(), CV_8U);
    EXPECT_EQ(pixels.size(), cv::Size(1760, 1760));
    EXPECT_GT(cv::mean(pixels)[0], 20);
  }
  MARROW_NEED_DATA(knee, "knee/images/L_Hop_Cam1_001_UND.0138.tif");
  EXPECT_EQ(read(knee).pixels.type(), CV_8U);
}

TEST(ReadImage, RefusesOtherThanOneGreyImage) {
  const TemporaryFolder folder;
  ItkGrid<std::uint16_t> pages{.size = {4, 4, 3}, .samples = std::vector<std::uint16_t>(48)};
  write_itk(folder / "pages.tif", pages);
  EXPECT_SAYS(read(folder / "pages.tif"), "has 3 pages; an image has one");
  EXPECT_SAYS(read(folder / "absent.png"), "there is no such file");
  EXPECT_SAYS(read(folder.path()), "expected a file, this is none");
  std::filesystem::create_directory(folder / "folder.png");
  EXPECT_SAYS(read(folder / "folder.png"), "expected a file, this is none");
}

TEST(ReadImage, DamagedFilesAreDiagnosed) {
  const TemporaryFolder folder;
  ItkGrid<std::uint16_t> noise{.size = {60, 40}};
  for (unsigned i = 0; i < 2400; ++i) noise.samples.push_back(std::uint16_t(i * 40503u));
  for (const char* extension : {".png", ".tif"}) {
    SCOPED_TRACE(extension);
    write_itk(folder / ("good" + std::string(extension)), noise);
    marrow::test::expect_damage_is_diagnosed(folder / ("good" + std::string(extension)),
                                             folder / ("damaged" + std::string(extension)),
                                             [](const auto& path) { read(path); });
  }
}

// Programs show such an image turned; an X-ray that is read unturned would be registered against the wrong side.
TEST(ReadImage, PngThatIsToBeTurnedIsRefused) {
  const TemporaryFolder folder;
  write_itk(folder / "a.png", ramp<std::uint8_t>(7, 5, 3));
  const std::string bytes = marrow::test::bytes_of(folder / "a.png");
  const auto with_exif = [&](const std::string& exif) {
    const std::string chunk = "eXIf" + exif;
    const auto crc = std::uint32_t(crc32(0, reinterpret_cast<const Bytef*>(chunk.data()), unsigned(chunk.size())));
    const auto big = [](std::uint32_t value) {
      return std::string{char(value >> 24), char(value >> 16), char(value >> 8), char(value)};
    };
    marrow::test::put(folder / "b.png",
                      bytes.substr(0, 33) + big(std::uint32_t(exif.size())) + chunk + big(crc) + bytes.substr(33));
    return folder / "b.png";
  };
  using namespace std::string_literals;
  const auto little = [](char orientation) {
    return "II*\0\x08\0\0\0\x01\0\x12\x01\x03\0\x01\0\0\0"s + orientation + "\0\0\0\0\0\0\0"s;
  };
  for (char orientation = 2; orientation <= 8; ++orientation)
    EXPECT_SAYS(read(with_exif(little(orientation))),
                "is to be shown turned or mirrored (Exif Orientation " + std::to_string(orientation));
  EXPECT_SAYS(read(with_exif("MM\0*\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01\0\x06\0\0\0\0\0\0"s)),
              "Exif Orientation 6");
  for (const std::string& exif :
       {little(1), little(0), "II*\0"s, "II*\0\xff\xff\xff\xff"s, "junk"s, little(6).substr(0, 12)})
    EXPECT_EQ(read(with_exif(exif)).pixels.size(), cv::Size(7, 5));
}

TEST(ReadImage, DamagedRealTiffIsDiagnosed) {
  MARROW_NEED_DATA(path, "wrist/images/xr_rad_uln_cam01_UND.0158.tif");
  const TemporaryFolder folder;
  marrow::test::expect_damage_is_diagnosed(path, folder / "damaged.tif", [](const auto& damaged) { read(damaged); });
}

TEST(ReadImage, PngThatClaimsAHugeSizeIsRefused) {
  const TemporaryFolder folder;
  write_itk(folder / "a.png", ramp<std::uint8_t>(7, 5, 3));
  std::string bytes = marrow::test::bytes_of(folder / "a.png");
  // IHDR: width and height at 16, then the checksum over type and data at 29, made right for the new size.
  bytes.replace(16, 8, std::string("\0\0\xEA\x60\0\0\xEA\x60", 8));  // 60000 x 60000
  std::uint32_t checksum = 0xFFFFFFFFu;
  for (std::size_t i = 12; i < 29; ++i) {
    checksum ^= std::uint8_t(bytes[i]);
    for (int k = 0; k < 8; ++k) checksum = checksum >> 1 ^ (checksum & 1 ? 0xEDB88320u : 0);
  }
  checksum = ~checksum;
  for (int k = 0; k < 4; ++k) bytes[29 + k] = char(checksum >> (24 - 8 * k));
  marrow::test::put(folder / "huge.png", bytes);
  EXPECT_SAYS(read(folder / "huge.png"), "its header claims 60000 x 60000 x 1 samples, but the file has only");
}

TEST(ReadImage, DicomAsItsCameraSeesIt) {
  using marrow::test::dicom_file;
  using marrow::test::fluoroscopy;
  const TemporaryFolder folder;
  const auto put = [&](const marrow::test::Elements& elements) {
    marrow::test::put(folder / "x.dcm", dicom_file(elements));
  };
  auto elements = fluoroscopy();
  put(elements);
  cv::Mat pixels = read(folder / "x.dcm").pixels;
  ASSERT_EQ(pixels.type(), CV_16U);
  ASSERT_EQ(pixels.size(), cv::Size(6, 4));
  EXPECT_EQ(pixels.at<std::uint16_t>(3, 1), 301);
  elements[0x00200020] = "CS:L\\F";  // as one facing the patient sees it
  put(elements);
  EXPECT_EQ(read(folder / "x.dcm").pixels.at<std::uint16_t>(3, 1), 304) << "mirrored back";
  elements = fluoroscopy();
  elements[0x00281041] = "SS:-1";  // higher values are less radiation
  put(elements);
  EXPECT_EQ(read(folder / "x.dcm").pixels.at<std::uint16_t>(3, 1), 65535 - 301) << "of 16 bits";
}

TEST(ReadImage, DicomFrames) {
  const TemporaryFolder folder;
  auto elements = marrow::test::fluoroscopy();
  elements[0x00280008] = "IS:2";
  std::string second = elements[0x7FE00010].substr(3);
  for (std::size_t i = 0; i < second.size(); i += 2) second[i] = char(second[i] ^ 1);
  elements[0x7FE00010] += second;
  marrow::test::put(folder / "x.dcm", marrow::test::dicom_file(elements));
  EXPECT_SAYS(read(folder / "x.dcm"), "x.dcm: has 2 frames; name one with frame (from 1)");
  EXPECT_EQ(read(folder / "x.dcm", 1).pixels.at<std::uint16_t>(0, 2), 2);
  EXPECT_EQ(read(folder / "x.dcm", 2).pixels.at<std::uint16_t>(0, 2), 3);
  EXPECT_SAYS(read(folder / "x.dcm", 3), "has 2 frames; there is no frame 3");
}

// What an enhanced file says of each frame: values, what they stand for, and whether it is mirrored.
TEST(ReadImage, DicomFramesHaveTheirOwnValues) {
  using marrow::test::dicom_item;
  const TemporaryFolder folder;
  auto elements = marrow::test::fluoroscopy();
  elements[0x00280008] = "IS:2";
  elements[0x7FE00010] += elements[0x7FE00010].substr(3);
  elements.erase(0x00181510);
  elements.erase(0x00181511);
  const auto groups = [](const char* slope, const char* sign, const char* primary) {
    return dicom_item({{0x00189405, dicom_item({{0x00181510, primary}, {0x00181511, "DS:0"}})},
                       {0x00289145, dicom_item({{0x00281052, "DS:0"}, {0x00281053, slope}})},
                       {0x00289443, dicom_item({{0x00281041, sign}})}});
  };
  elements[0x52009230] = groups("DS:1", "SS:1", "DS:0") + groups("DS:2", "SS:-1", "DS:180").substr(3);
  marrow::test::put(folder / "x.dcm", marrow::test::dicom_file(elements));
  EXPECT_EQ(read(folder / "x.dcm", 1).pixels.at<std::uint16_t>(3, 1), 301);
  // Of the second one: twice the values, the highest of 16 bits the darkest; from behind, "R\\F" is mirrored.
  EXPECT_EQ(read(folder / "x.dcm", 2).pixels.at<float>(3, 1), 2 * (65535 - 304));
}

}  // namespace image_test
