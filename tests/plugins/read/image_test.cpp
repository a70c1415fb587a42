// SPDX-License-Identifier: Apache-2.0
// Images by read.image: bits and orientation, frames of DICOM, and what the header of an X-ray image says about left
// and right.
#include <zlib.h>

#include "marrow/toolbox/files/volume_file.hpp"
#include "tests/plugins/read/dicom_text.hpp"
#include "tests/plugins/read/itk_files.hpp"
#include "tests/plugins/read/reading.hpp"

namespace image_test {

using namespace marrow;
using namespace marrow::test;
using namespace std::string_literals;

cv::Mat read(const std::filesystem::path& path, int frame = 0) {
  return read_by<Image>("read.image", path, {{"frame", std::int64_t{frame}}}).pixels;
}

std::string big(std::uint32_t value) {
  const std::string bytes = number(value);
  return {bytes.rbegin(), bytes.rend()};
}

/// A chunk of a PNG.
std::string chunk(const std::string& name, const std::string& content) {
  const std::string summed = name + content;
  const auto crc = crc32(0, reinterpret_cast<const Bytef*>(summed.data()), unsigned(summed.size()));
  return big(std::uint32_t(content.size())) + summed + big(std::uint32_t(crc));
}

class ReadImage : public InAFolder {
 protected:
  template <class T>
  cv::Mat of(const std::string& name, const ItkGrid<T>& grid) {
    write_itk(folder / name, grid);
    return read(folder / name);
  }
  cv::Mat of(const std::string& name, const std::string& bytes, int frame = 0) {
    put(folder / name, bytes);
    return read(folder / name, frame);
  }
  cv::Mat of(const Elements& elements, int frame = 0) { return of("x.dcm", dicom_file(elements), frame); }
};

TEST_F(ReadImage, IsTurnedOverWhereThatIsAskedFor) {
  write_itk(folder / "a.png", ramp<std::uint8_t>({7, 5}, 1));
  const auto turned = [&](const std::string& mirror) {
    return read_by<Image>("read.image", folder / "a.png", {{"mirror", mirror}}).pixels;
  };
  EXPECT_EQ(turned("none").at<std::uint8_t>(1, 2), 7 + 2);
  EXPECT_EQ(turned("left_right").at<std::uint8_t>(1, 7 - 1 - 2), 7 + 2);
  EXPECT_EQ(turned("upside_down").at<std::uint8_t>(5 - 1 - 1, 2), 7 + 2);
}

TEST_F(ReadImage, KeepsBitsAndOrientation) {
  for (const char* name : {"a.png", "a.tif"}) {
    cv::Mat pixels = of(name, ramp<std::uint8_t>({7, 5}, 3));
    ASSERT_EQ(pixels.type(), CV_8U);
    ASSERT_EQ(pixels.size(), cv::Size(7, 5));
    EXPECT_EQ(pixels.at<std::uint8_t>(1, 2), (7 + 2) * 3) << name << ": row 1, column 2 from the top left";
    pixels = of(name, ramp<std::uint16_t>({7, 5}, 1801));
    ASSERT_EQ(pixels.type(), CV_16U);
    EXPECT_EQ(pixels.at<std::uint16_t>(4, 6), 34 * 1801) << name;
  }
  EXPECT_EQ(of("c.tif", ramp<float>({7, 5}, 0.125)).at<float>(4, 6), 34 * 0.125f);
}

TEST_F(ReadImage, RealFluoroscopy) {
  for (const char* name :
       {"wrist/images/xr_rad_uln_cam01_UND.0002.tif", "wrist/images/xr_rad_uln_cam02_UND.0158.tif"}) {
    MARROW_NEED_DATA(path, name);
    const cv::Mat pixels = read(path);
    EXPECT_EQ(pixels.type(), CV_8U);
    EXPECT_EQ(pixels.size(), cv::Size(1760, 1760));
    EXPECT_GT(cv::mean(pixels)[0], 20);
  }
  MARROW_NEED_DATA(knee, "knee/images/L_Hop_Cam1_001_UND.0138.tif");
  EXPECT_EQ(read(knee).type(), CV_8U);
}

TEST_F(ReadImage, OtherThanOneGreyImageIsRefused) {
  EXPECT_SAYS(of("pages.tif", filled<std::uint16_t>({4, 4, 3}, 0)), "has 3 pages; an image has one");
  EXPECT_SAYS(read(folder / "absent.png"), "there is no such file");
  EXPECT_SAYS(read(folder.path()), "expected a file, this is none");
  std::filesystem::create_directory(folder / "folder.png");
  EXPECT_SAYS(read(folder / "folder.png"), "expected a file, this is none");
}

// Programs show such an image turned; an X-ray that is read unturned would be registered against the wrong side.
TEST_F(ReadImage, PngThatIsToBeTurnedIsRefused) {
  const std::string png = itk_bytes(".png", ramp<std::uint8_t>({7, 5}, 3));
  const auto with_exif = [&](const std::string& exif) {
    return of("b.png", png.substr(0, 33) + chunk("eXIf", exif) + png.substr(33));
  };
  const auto in_little_endian = [](char orientation) {
    return "II*\0\x08\0\0\0\x01\0\x12\x01\x03\0\x01\0\0\0"s + orientation + "\0\0\0\0\0\0\0"s;
  };
  for (char orientation = 2; orientation <= 8; ++orientation)
    EXPECT_SAYS(with_exif(in_little_endian(orientation)),
                "is to be shown turned or mirrored (Exif Orientation " + std::to_string(orientation));
  EXPECT_SAYS(with_exif("MM\0*\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01\0\x06\0\0\0\0\0\0"s), "Exif Orientation 6");
  for (const std::string& exif : {in_little_endian(1), in_little_endian(0), "II*\0"s, "II*\0\xff\xff\xff\xff"s, "junk"s,
                                  in_little_endian(6).substr(0, 12)})
    EXPECT_EQ(with_exif(exif).size(), cv::Size(7, 5));
}

TEST_F(ReadImage, PngThatClaimsAHugeSizeIsRefused) {
  const std::string png = itk_bytes(".png", ramp<std::uint8_t>({7, 5}, 3));
  const std::string header = chunk("IHDR", big(60000) + big(60000) + png.substr(24, 5));
  EXPECT_SAYS(of("huge.png", replaced(png, 8, header)),
              "its header claims 60000 x 60000 x 1 samples, but the file has only");
}

TEST_F(ReadImage, DicomAsItsCameraSeesIt) {
  const cv::Mat pixels = of(fluoroscopy());
  ASSERT_EQ(pixels.type(), CV_16U);
  ASSERT_EQ(pixels.size(), cv::Size(6, 4));
  EXPECT_EQ(pixels.at<std::uint16_t>(3, 1), 301);
  const cv::Mat facing = of(but(fluoroscopy(), {{0x00200020, "CS:L\\F"}}));  // as one facing the patient sees it
  EXPECT_EQ(facing.at<std::uint16_t>(3, 1), 304) << "mirrored back";
  const cv::Mat less = of(but(fluoroscopy(), {{0x00281041, "SS:-1"}}));  // higher values are less radiation
  EXPECT_EQ(less.at<std::uint16_t>(3, 1), 65535 - 301) << "of 16 bits";
}

TEST_F(ReadImage, DicomFrames) {
  Elements elements = but(fluoroscopy(), {{0x00280008, "IS:2"}});
  std::string second = elements[0x7FE00010].substr(3);
  for (std::size_t i = 0; i < second.size(); i += 2) second[i] = char(second[i] ^ 1);
  elements[0x7FE00010] += second;
  EXPECT_SAYS(of(elements), "x.dcm: has 2 frames; name one with frame (from 1)");
  EXPECT_EQ(of(elements, 1).at<std::uint16_t>(0, 2), 2);
  EXPECT_EQ(of(elements, 2).at<std::uint16_t>(0, 2), 3);
  EXPECT_SAYS(of(elements, 3), "has 2 frames; there is no frame 3");
}

// What an enhanced file says of each frame: values, what they stand for, and whether it is mirrored.
TEST_F(ReadImage, DicomFramesHaveTheirOwnValues) {
  Elements elements = without(but(fluoroscopy(), {{0x00280008, "IS:2"}}), {0x00181510, 0x00181511});
  elements[0x7FE00010] += elements[0x7FE00010].substr(3);
  const auto groups = [](const char* slope, const char* sign, const char* primary) {
    return dicom_elements({{0x00189405, dicom_item({{0x00181510, primary}, {0x00181511, "DS:0"}})},
                           {0x00289145, dicom_item({{0x00281052, "DS:0"}, {0x00281053, slope}})},
                           {0x00289443, dicom_item({{0x00281041, sign}})}});
  };
  elements[0x52009230] = dicom_items({groups("DS:1", "SS:1", "DS:0"), groups("DS:2", "SS:-1", "DS:180")});
  EXPECT_EQ(of(elements, 1).at<std::uint16_t>(3, 1), 301);
  // Of the second one: twice the values, the highest of 16 bits the darkest; from behind, "R\\F" is mirrored.
  EXPECT_EQ(of(elements, 2).at<float>(3, 1), 2 * (65535 - 304));
}

// ---- left and right

using Doubts = std::vector<std::string>;
constexpr std::uint32_t kOrientation = 0x00200020, kFlip = 0x00187034, kPrimary = 0x00181510, kSecondary = 0x00181511;

/// Of an arm at these angles, whose world has the patient's axes.
Camera camera_at(double secondary_deg, double primary_deg) {
  return carm_camera(CArm{6, 4, {0.3, 0.4}, 1000, 600, Eigen::Vector3d::Zero()},
                     world_from_camera_rotation(radians(secondary_deg), radians(primary_deg)));
}

class ImageSides : public InAFolder {
 protected:
  /// Without the folder's name.
  Doubts said(const Elements& elements, const std::optional<Camera>& camera = {}) {
    put(folder / "a.dcm", dicom_file(elements));
    Doubts doubts =
        camera ? files::doubts_about_sides(folder / "a.dcm", 0, *camera) : files::doubts_about_sides(folder / "a.dcm");
    for (std::string& doubt : doubts) doubt = without_folder(doubt, folder.path());
    return doubts;
  }
};

const Elements kFlipped{{kFlip, "CS:YES"}};
const std::string kDoubtOfFlip =
    "/a.dcm: was flipped left to right after it was taken (FieldOfViewHorizontalFlip (0018,7034)), and "
    "PatientOrientation (0020,0020) does not say how the patient lies in it; it may be mirrored: compare it with the "
    "anatomy, or mark landmarks in two views, and mirror the image if it is";

TEST_F(ImageSides, WithoutAReasonNothingIsSaidAndAFlipOrMissingAnglesAreOne) {
  EXPECT_EQ(said(fluoroscopy()), Doubts());
  EXPECT_EQ(said(but(fluoroscopy(), kFlipped)), Doubts()) << "the orientation is that of the image as it is stored";
  EXPECT_EQ(said(but(without(fluoroscopy(), {kOrientation}), {{kFlip, "CS:NO"}})), Doubts());
  EXPECT_EQ(said(without(fluoroscopy(), {kOrientation})), Doubts());
  put(folder / "a.png", "whatever");
  EXPECT_EQ(files::doubts_about_sides(folder / "a.png"), Doubts());
  EXPECT_EQ(files::doubts_about_sides(folder / "a.png", 0, camera_at(0, 0)), Doubts());
  const Elements elements = but(without(fluoroscopy(), {kOrientation}), kFlipped);
  EXPECT_EQ(said(elements), Doubts{kDoubtOfFlip});
  EXPECT_EQ(said(elements, camera_at(0, 0)), Doubts{kDoubtOfFlip}) << "angles do not help where nothing is known";
  EXPECT_EQ(said(but(elements, {{kOrientation, "CS:X\\F"}})), Doubts{kDoubtOfFlip}) << "letters that nobody knows";
  EXPECT_EQ(said(without(fluoroscopy(), {kPrimary})),
            Doubts{"/a.dcm: the patient's right is on its right and the feet below (PatientOrientation (0020,0020)), "
                   "but the header does not say from where it was taken; whether it is mirrored is not known: compare "
                   "it with the anatomy, or mark landmarks in two views, and mirror the image if it is"});
}

// In the frontal view of marrow's cameras, the patient's right is on the right. From behind it is on the left.
TEST_F(ImageSides, ACameraOfAnglesDecides) {
  const auto oriented = [](const char* orientation) {
    return but(without(fluoroscopy(), {kPrimary, kSecondary}), {{kOrientation, orientation}});
  };
  EXPECT_EQ(said(oriented("CS:R\\F"), camera_at(0, 0)), Doubts());
  EXPECT_EQ(said(oriented("CS:R\\F"), camera_at(20, 30)), Doubts());
  EXPECT_EQ(
      said(oriented("CS:R\\F"), camera_at(0, 180)),
      Doubts{"/a.dcm: is mirrored: by its header (PatientOrientation (0020,0020)) the patient's right is on the right "
             "and the feet below, as nobody sees it from the source of this camera; mirror the image, or correct the "
             "angles"});
  EXPECT_EQ(said(oriented("CS:L\\F"), camera_at(0, 0)).size(), 1u);
  EXPECT_EQ(said(oriented("CS:L\\F"), camera_at(0, 180)), Doubts());
  EXPECT_EQ(said(oriented("CS:P\\F"), camera_at(0, 0)), Doubts())
      << "a side view is no mirrored frontal one: nothing is guessed";
  // What read_image_file() mirrors back is no longer mirrored.
  const Elements elements = but(fluoroscopy(), {{kOrientation, "CS:L\\F"}});
  EXPECT_EQ(said(elements, camera_at(0, 0)), Doubts());
  EXPECT_EQ(said(elements, camera_at(0, 180)).size(), 1u) << "the case's angles contradict the header's";
}

}  // namespace image_test
