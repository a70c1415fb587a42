// SPDX-License-Identifier: Apache-2.0
// What the header of an X-ray image says about left and right.
#include "marrow/toolbox/files/image_sides.hpp"

#include <gtest/gtest.h>

#include "marrow/domain/c_arm.hpp"
#include "shipped.hpp"
#include "tests/plugins/read/dicom_text.hpp"
#include "tests/plugins/read/files.hpp"

namespace image_sides_test {

using marrow::test::Elements;
using marrow::test::fluoroscopy;
using marrow::test::put;
using marrow::test::TemporaryFolder;
using Doubts = std::vector<std::string>;

constexpr std::uint32_t kOrientation = 0x00200020, kFlip = 0x00187034, kPrimary = 0x00181510, kSecondary = 0x00181511;

/// Of an arm at these angles, whose world has the patient's axes.
marrow::Camera camera_at(double secondary_deg, double primary_deg) {
  marrow::CArm arm;
  arm.width_px = 6;
  arm.height_px = 4;
  arm.source_to_detector_mm = 1000;
  arm.source_to_isocentre_mm = 600;
  arm.pixel_mm = {0.3, 0.4};
  return carm_camera(arm,
                     marrow::world_from_camera_rotation(marrow::radians(secondary_deg), marrow::radians(primary_deg)));
}

class ImageSides : public testing::Test {
 protected:
  std::filesystem::path write(const Elements& elements) {
    put(folder / "a.dcm", marrow::test::dicom_file(elements));
    return folder / "a.dcm";
  }
  /// Without the folder's name.
  Doubts said(const Elements& elements) { return cut(marrow::files::doubts_about_sides(write(elements))); }
  Doubts said(const Elements& elements, const marrow::Camera& camera) {
    return cut(marrow::files::doubts_about_sides(write(elements), 0, camera));
  }
  Doubts cut(Doubts doubts) {
    for (std::string& doubt : doubts) doubt = marrow::test::without_folder(doubt, folder.path());
    return doubts;
  }
  TemporaryFolder folder;
};

const char* kFlipped =
    "/a.dcm: was flipped left to right after it was taken (FieldOfViewHorizontalFlip (0018,7034)), and "
    "PatientOrientation (0020,0020) does not say how the patient lies in it; it may be mirrored: compare it with the "
    "anatomy, or mark landmarks in two views, and mirror the image if it is";

TEST_F(ImageSides, NothingIsSaidWithoutAReason) {
  Elements elements = fluoroscopy();
  EXPECT_EQ(said(elements), Doubts());
  elements[kFlip] = "CS:YES";
  EXPECT_EQ(said(elements), Doubts()) << "the orientation is that of the image as it is stored";
  elements.erase(kOrientation);
  elements[kFlip] = "CS:NO";
  EXPECT_EQ(said(elements), Doubts());
  elements.erase(kFlip);
  EXPECT_EQ(said(elements), Doubts());
  put(folder / "a.png", "whatever");
  EXPECT_EQ(marrow::files::doubts_about_sides(folder / "a.png"), Doubts());
  EXPECT_EQ(marrow::files::doubts_about_sides(folder / "a.png", 0, camera_at(0, 0)), Doubts());
}

TEST_F(ImageSides, AFlipOfAnUnknownOrientation) {
  Elements elements = fluoroscopy();
  elements.erase(kOrientation);
  elements[kFlip] = "CS:YES";
  EXPECT_EQ(said(elements), Doubts{kFlipped});
  EXPECT_EQ(said(elements, camera_at(0, 0)), Doubts{kFlipped}) << "angles do not help where nothing is known";
  elements[kOrientation] = "CS:X\\F";
  EXPECT_EQ(said(elements), Doubts{kFlipped}) << "letters that nobody knows";
}

TEST_F(ImageSides, AnOrientationWithoutAngles) {
  Elements elements = fluoroscopy();
  elements.erase(kPrimary);
  EXPECT_EQ(said(elements),
            Doubts{"/a.dcm: the patient's right is on its right and the feet below (PatientOrientation (0020,0020)), "
                   "but the header does not say from where it was taken; whether it is mirrored is not known: compare "
                   "it with the anatomy, or mark landmarks in two views, and mirror the image if it is"});
}

// In the frontal view of marrow's cameras, the patient's right is on the right. From behind it is on the left.
TEST_F(ImageSides, ACameraOfAnglesDecides) {
  Elements elements = fluoroscopy();
  elements.erase(kPrimary);
  elements.erase(kSecondary);
  EXPECT_EQ(said(elements, camera_at(0, 0)), Doubts());
  EXPECT_EQ(said(elements, camera_at(20, 30)), Doubts());
  const Doubts mirrored = said(elements, camera_at(0, 180));
  ASSERT_EQ(mirrored.size(), 1u);
  EXPECT_EQ(
      mirrored[0],
      "/a.dcm: is mirrored: by its header (PatientOrientation (0020,0020)) the patient's right is on the right and the "
      "feet below, as nobody sees it from the source of this camera; mirror the image, or correct the angles");
  elements[kOrientation] = "CS:L\\F";
  EXPECT_EQ(said(elements, camera_at(0, 0)).size(), 1u);
  EXPECT_EQ(said(elements, camera_at(0, 180)), Doubts());
  elements[kOrientation] = "CS:P\\F";
  EXPECT_EQ(said(elements, camera_at(0, 0)), Doubts()) << "a side view is no mirrored frontal one: nothing is guessed";
}

// What read_image_file() mirrors back is no longer mirrored.
TEST_F(ImageSides, WhatTheReaderMirrorsBackIsRight) {
  Elements elements = fluoroscopy();
  elements[kOrientation] = "CS:L\\F";
  EXPECT_EQ(said(elements, camera_at(0, 0)), Doubts());
  EXPECT_EQ(said(elements, camera_at(0, 180)).size(), 1u) << "the case's angles contradict the header's";
}

}  // namespace image_sides_test
