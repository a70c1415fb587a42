// SPDX-License-Identifier: Apache-2.0
#include "tests/plugins/read/dicom_text.hpp"
#include "tests/plugins/read/reading.hpp"

namespace dicom_test {

using namespace marrow;
using namespace marrow::test;
using Eigen::Vector3d, Eigen::Vector2d, Eigen::Matrix3d;
using DicomCamera = InAFolder;

constexpr std::uint32_t kPrimary = 0x00181510, kSecondary = 0x00181511, kOrientation = 0x00200020;

struct Read {
  Camera camera;
  std::vector<std::string> warnings;
};

List<Camera> cameras_of(const std::vector<std::string>& paths, shipped::Options options = {},
                        const Context& context = Context()) {
  options["paths"] = paths;
  return shipped::call("camera.dicom", {}, options, context).at("camera").as_list<Camera>();
}

Read read(const Elements& elements, const shipped::Options& options = {}) {
  const TemporaryFolder folder;
  put(folder / "x.dcm", dicom_file(elements));
  Read result;
  result.warnings =
      said_by([&](const Context& context) { result.camera = cameras_of({folder / "x.dcm"}, options, context)[0]; });
  return result;
}

void expect_one_warning(const Read& read, const std::string& words) {
  ASSERT_EQ(read.warnings.size(), 1u) << words;
  EXPECT_HAS(read.warnings[0], words);
}

shipped::Options frame(std::int64_t number) { return {{"frame", number}}; }

Vector3d towards_detector(const Camera& camera) { return camera.camera_from_world.rotation.row(2); }

/// Without PatientOrientation the angles alone decide.
Camera at(const std::string& primary, const std::string& secondary) {
  return read(but(without(fluoroscopy(), {kOrientation}),
                  {{kPrimary, "DS:" + primary}, {kSecondary, "DS:" + secondary}}))
      .camera;
}

TEST_F(DicomCamera, LeftAnteriorObliqueAndCranialArePositive) {
  EXPECT_TRUE(towards_detector(at("0", "0")).isApprox(-Vector3d::UnitY())) << "at 0 the patient faces the detector";
  EXPECT_TRUE(towards_detector(at("90", "0")).isApprox(Vector3d::UnitX())) << "+90: the patient's left";
  EXPECT_TRUE(towards_detector(at("-30", "0")).isApprox(Vector3d(-0.5, -std::sqrt(0.75), 0), 1e-12)) << "RAO 30";
  EXPECT_TRUE(towards_detector(at("0", "90")).isApprox(Vector3d::UnitZ()));
  const double c = std::cos(radians(20)), s = std::sin(radians(20));
  EXPECT_TRUE(towards_detector(at("0", "20")).isApprox(Vector3d(0, -c, s), 1e-12)) << "CRA 20";
  EXPECT_TRUE(towards_detector(at("0", "-20")).isApprox(Vector3d(0, -c, -s), 1e-12)) << "CAU 20";
}

// The example of PS3.17: RAO 30, CRA 20.
TEST_F(DicomCamera, BothAnglesTogether) {
  const double p = radians(-30), s = radians(20);
  const Vector3d expected(std::sin(p) * std::cos(s), -std::cos(p) * std::cos(s), std::sin(s));
  const Camera camera = at(" -30.0 ", "+20");
  EXPECT_TRUE(towards_detector(camera).isApprox(expected, 1e-12));
  EXPECT_LT((source_position_mm(camera) + 600 * expected).norm(), 1e-9)
      << "the source lies opposite, SOD from the isocentre";
}

TEST_F(DicomCamera, DistancesAndPixels) {
  const Camera camera = read(fluoroscopy()).camera;
  EXPECT_EQ(camera.width_px, 6);
  EXPECT_EQ(camera.height_px, 4);
  EXPECT_NEAR(camera.intrinsics(0, 0), 1000 / 0.3, 1e-9) << "the second value is the distance of columns";
  EXPECT_NEAR(camera.intrinsics(1, 1), 1000 / 0.4, 1e-9) << "the first value is the distance of rows";
  EXPECT_LT((project(camera, Vector3d::Zero()) - Vector2d(2.5, 1.5)).norm(), 1e-12);
  EXPECT_NEAR((camera.camera_from_world * Vector3d::Zero()).z(), 600, 1e-9);
}

TEST_F(DicomCamera, ImagerPixelSpacingComesFirst) {
  const Elements both = but(fluoroscopy(), {{0x00280030, "DS:0.24\\0.18"}});
  EXPECT_NEAR(read(both).camera.intrinsics(0, 0), 1000 / 0.3, 1e-9);
  EXPECT_TRUE(read(both).warnings.empty());
  const Read alone = read(without(both, {0x00181164}));
  EXPECT_NEAR(alone.camera.intrinsics(0, 0), 1000 / 0.18, 1e-9);
  expect_one_warning(alone, "ImagerPixelSpacing (0018,1164) is missing; PixelSpacing (0028,0030) is taken for it");
  const Read calibrated = read(but(without(both, {0x00181164}), {{0x00280a02, "CS:GEOMETRY"}}));
  EXPECT_NEAR(calibrated.camera.intrinsics(0, 0), 1000 / 0.3, 1e-9)
      << "at the isocentre a pixel is smaller by SOD / SID";
  expect_one_warning(calibrated, "is calibrated to the patient, so it is multiplied by the magnification");
}

// An image of 6 x 4 pixels. A field of 30 mm across 6 pixels: 5 mm each.
TEST_F(DicomCamera, PixelsFromTheFieldOfView) {
  const Elements none = without(fluoroscopy(), {0x00181164, 0x00280030});
  const auto focal = [](const Read& found) {
    return Vector2d(found.camera.intrinsics(0, 0), found.camera.intrinsics(1, 1));
  };
  const Read round = read(but(none, {{0x00181147, "CS:ROUND"}, {0x00181149, "IS:30"}}));
  EXPECT_LT((focal(round) - Vector2d(200, 200)).norm(), 1e-9);
  expect_one_warning(
      round,
      "ImagerPixelSpacing (0018,1164) and PixelSpacing (0028,0030) are missing; a pixel is taken as 5 x 5 "
      "mm, because the image of 6 x 4 px shows a field of 30 mm (FieldOfViewDimensions (0018,1149)); check");
  // 6 pixels over 24 mm and 4 over 20 mm, in either order.
  for (const char* dimensions : {"IS:24\\20", "IS:20\\24"}) {
    const Read rectangle = read(but(none, {{0x00181147, "CS:RECTANGLE"}, {0x00181149, dimensions}}));
    EXPECT_LT((focal(rectangle) - Vector2d(250, 200)).norm(), 1e-9) << focal(rectangle);
  }
  const Read intensifier = read(but(none, {{0x00181162, "DS:54"}}));
  EXPECT_LT((focal(intensifier) - Vector2d(1000 / 9.0, 1000 / 9.0)).norm(), 1e-9);
  expect_one_warning(intensifier, "with a zoom the field, and so the pixel, is smaller");
  // The field of view counts more: a zoom makes it smaller than the intensifier.
  const Read zoomed = read(but(none, {{0x00181162, "DS:54"}, {0x00181149, "IS:30"}}));
  EXPECT_LT((focal(zoomed) - Vector2d(200, 200)).norm(), 1e-9);
  EXPECT_SAYS(read(but(none, {{0x00181162, "DS:-3"}})), "IntensifierSize (0018,1162) is -3.000000 mm; give pixel_mm");
}

TEST_F(DicomCamera, IsocentreDistanceFromTheMagnification) {
  const Elements header = but(without(fluoroscopy(), {0x00181111}), {{0x00181114, "DS:1.6"}});
  EXPECT_NEAR((read(header).camera.camera_from_world * Vector3d::Zero()).z(), 1000 / 1.6, 1e-9);
}

TEST_F(DicomCamera, NamesAllThatIsMissing) {
  EXPECT_SAYS(read(without(fluoroscopy(), {0x00181110, 0x00181111, 0x00181164, kPrimary, kSecondary})),
              "x.dcm: its header does not say how it was taken; missing: PositionerPrimaryAngle (0018,1510) (or "
              "describe the C-arm yourself); "
              "PositionerSecondaryAngle (0018,1511) (or describe the C-arm yourself); DistanceSourceToDetector "
              "(0018,1110) (or give "
              "source_to_detector_mm); DistanceSourceToPatient (0018,1111) or EstimatedRadiographicMagnificationFactor "
              "(0018,1114) (or "
              "give source_to_isocentre_mm); ImagerPixelSpacing (0018,1164) (or give pixel_mm)");
  const shipped::Options given{{"source_to_detector_mm", 1100.0}, {"source_to_isocentre_mm", 700.0}, {"pixel_mm", 0.5}};
  const Camera camera = read(without(fluoroscopy(), {0x00181110, 0x00181111, 0x00181164}), given).camera;
  EXPECT_NEAR(camera.intrinsics(0, 0), 2200, 1e-9);
  EXPECT_NEAR((camera.camera_from_world * Vector3d::Zero()).z(), 700, 1e-9);
}

// PatientOrientation says which side of the patient the image shows to the right and downwards. In every case the
// camera must project the patient's left to where the image, as it is read, shows it.
TEST_F(DicomCamera, OrientationOfTheStoredImage) {
  const Vector3d left(20, 0, 0), head(0, 0, 20), back(0, 20, 0);
  const auto moved = [](const Camera& camera, const Vector3d& to) {
    return Vector2d(project(camera, to) - project(camera, Vector3d::Zero()));
  };
  // As seen from the source: the patient's right is to the right.
  Camera camera = read(fluoroscopy()).camera;
  EXPECT_LT(moved(camera, left).x(), 0);
  EXPECT_LT(moved(camera, head).y(), 0);
  // As a person who faces the patient sees it. It is stored mirrored and mirrored back when read, so the camera stays.
  camera = read(but(fluoroscopy(), {{kOrientation, "CS:L\\F"}})).camera;
  EXPECT_LT(moved(camera, left).x(), 0);
  EXPECT_LT(moved(camera, head).y(), 0);
  EXPECT_TRUE(read(but(fluoroscopy(), {{kOrientation, "CS:L\\F"}})).warnings.empty());
  // Turned by 180 and by 90 degrees.
  camera = read(but(fluoroscopy(), {{kOrientation, "CS:L\\H"}})).camera;
  EXPECT_GT(moved(camera, left).x(), 0);
  EXPECT_GT(moved(camera, head).y(), 0);
  camera = read(but(fluoroscopy(), {{kOrientation, "CS:F\\L"}})).camera;
  EXPECT_LT(moved(camera, head).x(), 0);
  EXPECT_GT(moved(camera, left).y(), 0);
  // Lateral from the left: the detector at the patient's left.
  camera = read(but(fluoroscopy(), {{kPrimary, "DS:90"}, {kOrientation, "CS:A\\F"}})).camera;
  EXPECT_TRUE(towards_detector(camera).isApprox(Vector3d::UnitX()));
  EXPECT_LT(moved(camera, head).y(), 0);
  for (const char* letters : {"A\\F", "P\\F"})
    EXPECT_GT(
        moved(read(but(fluoroscopy(), {{kPrimary, "DS:90"}, {kOrientation, std::string("CS:") + letters}})).camera,
              back)
                .x() *
            moved(camera, back).x(),
        0)
        << "mirrored or not, the image as read is the one that the source sees";
  // Oblique, with two letters each.
  EXPECT_TRUE(read(but(fluoroscopy(), {{kPrimary, "DS:40"}, {kOrientation, "CS:RP\\F"}})).warnings.empty());
  EXPECT_SAYS(
      read(but(fluoroscopy(), {{kOrientation, "CS:A\\F"}})),
      "PatientOrientation (0020,0020) says 'A\\F', which no view from these angles shows; one of them is wrong");
}

TEST_F(DicomCamera, WarnsWhereTheHeaderIsSilentOrTheCentreMayLieElsewhere) {
  const Read silent = read(without(fluoroscopy(), {kOrientation}));
  expect_one_warning(
      silent,
      "PatientOrientation (0020,0020) is missing, so the image is taken to have the head up and to be seen "
      "from the source");
  const Read prone = read(but(fluoroscopy(), {{0x00185100, "CS:HFP"}}));
  expect_one_warning(prone, "PatientPosition (0018,5100) is HFP");
  for (const auto& [tag, value, name] : {std::tuple{0x00187030u, "DS:500\\0", "FieldOfViewOrigin (0018,7030)"},
                                         {0x00189430u, "FL:510", "PositionOfIsocenterProjection (0018,9430)"}}) {
    const Read warned = read(but(fluoroscopy(), {{tag, value}}));
    expect_one_warning(warned, std::string(name) + " is not used: the ray through the isocentre is taken to meet");
  }
  EXPECT_EQ(read(but(fluoroscopy(), {{0x00187030, "DS:500\\0"}, {0x00189430, "FL:510"}})).warnings.size(), 1u);
}

TEST_F(DicomCamera, RefusesWhatCannotBe) {
  EXPECT_SAYS(read(but(fluoroscopy(), {{0x00080060, "CS:CT"}})), "is of modality 'CT'; expected XA or RF");
  EXPECT_SAYS(read(but(fluoroscopy(), {{0x00181110, "DS:500"}})),
              "the isocentre (600.000000 mm from the source) lies behind the detector");
  EXPECT_SAYS(read(but(fluoroscopy(), {{0x00181110, "DS:1.0"}, {0x00181111, "DS:0.6"}})), "mm, which no C-arm has");
  EXPECT_SAYS(read(but(fluoroscopy(), {{kSecondary, "DS:120"}})),
              "PositionerSecondaryAngle (0018,1511) is 120.000000, expected -90 to 90");
  EXPECT_SAYS(read(but(fluoroscopy(), {{kPrimary, "DS:left"}})),
              "PositionerPrimaryAngle (0018,1510): expected 1 number, got 'left'");
  EXPECT_SAYS(read(but(fluoroscopy(), {{0x00181164, "DS:0.3"}})),
              "ImagerPixelSpacing (0018,1164): expected 2 numbers, got '0.3'");
  EXPECT_SAYS(read(but(fluoroscopy(), {{0x00181500, "CS:DYNAMIC"}}), frame(2)), "the arm moves during this run");
}

// Enhanced files keep the same elements in sequences: shared by all frames, or one item for each frame.
TEST_F(DicomCamera, EnhancedFile) {
  Elements header = without(fluoroscopy(), {0x00181110, 0x00181111, kPrimary, kSecondary});
  header[0x52009229] = dicom_item({{0x00189476, dicom_item({{0x00181110, "DS:1200"}, {0x00189402, "DS:780"}})}});
  header[0x52009230] = dicom_item({{0x00189405, dicom_item({{kPrimary, "DS:90"}, {kSecondary, "DS:0"}})}});
  header[kOrientation] = "CS:A\\F";
  const Camera camera = read(header).camera;
  EXPECT_NEAR(camera.intrinsics(0, 0), 1200 / 0.3, 1e-9);
  EXPECT_NEAR((camera.camera_from_world * Vector3d::Zero()).z(), 780, 1e-9);
  EXPECT_TRUE(towards_detector(camera).isApprox(Vector3d::UnitX()));
}

// Enhanced files have it as a binary number of 4 bytes.
TEST_F(DicomCamera, IsocentreDistanceAsABinaryNumber) {
  const Elements header = but(without(fluoroscopy(), {0x00181111}), {{0x00189402, "FL:785.5"}});
  EXPECT_NEAR((read(header).camera.camera_from_world * Vector3d::Zero()).z(), 785.5, 1e-9);
  put(folder / "x.dcm", implicit_file(header));
  EXPECT_NEAR((cameras_of({folder / "x.dcm"})[0].camera_from_world * Vector3d::Zero()).z(), 785.5, 1e-9);
  EXPECT_SAYS(read(but(header, {{0x00189402, "FL:nan"}})),
              "DistanceSourceToIsocenter (0018,9402): expected 1 number, got 4 bytes");
}

// Implicit files do not say that these are sequences.
TEST_F(DicomCamera, AnglesOfEachFrameInAnImplicitFile) {
  Elements header = without(fluoroscopy(), {kPrimary, kSecondary, kOrientation});
  std::vector<std::string> frames;
  for (const char* angle : {"DS:0", "DS:90"})
    frames.push_back(
        implicit_elements({{0x00189405, dicom_items({implicit_elements({{kPrimary, angle}, {kSecondary, "DS:0"}})})}}));
  header[0x00280008] = "IS:2";
  header[0x7FE00010] += header[0x7FE00010].substr(3);
  header[0x52009230] = dicom_items(frames);
  put(folder / "x.dcm", implicit_file(header));
  EXPECT_TRUE(towards_detector(cameras_of({folder / "x.dcm"}, frame(2))[0]).isApprox(Vector3d::UnitX()));
}

/// Three frames, at these angles.
Elements frames_at(const std::vector<std::string>& angles) {
  Elements header = without(fluoroscopy(), {kPrimary, kSecondary, kOrientation});
  std::vector<std::string> frames;
  const std::string pixels = header[0x7FE00010].substr(3);
  header[0x7FE00010] = "OW:";
  for (const std::string& angle : angles) {
    frames.push_back(dicom_elements({{0x00189405, dicom_item({{kPrimary, "DS:" + angle}, {kSecondary, "DS:0"}})}}));
    header[0x7FE00010] += pixels;
  }
  header[0x00280008] = "IS:" + std::to_string(angles.size());
  header[0x52009230] = dicom_items(frames);
  return header;
}

// The image may show any of them: read.views reads the frame that its option names.
TEST_F(DicomCamera, FramesWithAGeometryEachMustBeNamed) {
  const Elements turning = frames_at({"0", "30", "60"});
  EXPECT_SAYS(
      read(turning),
      "x.dcm: has 3 frames with a geometry each (frame 1 at 0, 0 degrees; frame 2 at 30, 0 degrees; frame 3 at 60, 0 "
      "degrees); name the one that the image is of with frame (from 1)");
  const Matrix3d third = read(turning, frame(3)).camera.camera_from_world.rotation;
  EXPECT_TRUE(third.isApprox(at("60", "0").camera_from_world.rotation));
  EXPECT_TRUE(read(frames_at({"60", "60", "60"})).camera.camera_from_world.rotation.isApprox(third)) << "all alike";
  EXPECT_SAYS(read(turning, frame(4)), "x.dcm: has 3 frames; there is no frame 4");
}

TEST_F(DicomCamera, IncrementsOfTheAnglesAreMotion) {
  Elements header = but(fluoroscopy(), {{0x00280008, "IS:3"}});
  const std::string pixels = header[0x7FE00010].substr(3);
  header[0x7FE00010] += pixels + pixels;
  const Elements still = but(header, {{0x00181520, "DS:0\\0\\0"}, {0x00181500, "CS:STATIC"}});
  EXPECT_EQ(read(still).camera.width_px, 6);
  for (const std::uint32_t tag : {0x00181520u, 0x00181521u}) {
    const Elements moving = but(still, {{tag, "DS:0\\30\\60"}});
    EXPECT_SAYS(read(moving), "the arm moves during this run of 3 frames");
    EXPECT_SAYS(read(moving, frame(3)), "use frame 1, or describe the C-arm yourself with the angles of frame 3");
    EXPECT_TRUE(read(moving, frame(1))
                    .camera.camera_from_world.rotation.isApprox(read(still).camera.camera_from_world.rotation));
  }
}

TEST_F(DicomCamera, OneCameraPerFileByName) {
  put(folder / "front.dcm", dicom_file(fluoroscopy()));
  put(folder / "side.dcm", dicom_file(but(fluoroscopy(), {{kPrimary, "DS:90"}, {kOrientation, "CS:A\\F"}})));
  const std::vector<std::string> paths{folder / "front.dcm", folder / "side.dcm"};
  EXPECT_EQ(cameras_of(paths).names(), (std::vector<std::string>{"front", "side"}));
  EXPECT_SAYS(cameras_of(paths, {{"names", std::vector<std::string>{"frontal", "frontal"}}}),
              "names: two views are named 'frontal'");
  EXPECT_TRUE(shipped::declares("camera.dicom", as_many_or_none("names", "paths")));
  EXPECT_TRUE(shipped::declares("camera.dicom", at_least_one({"paths"})));
}

}  // namespace dicom_test
