// SPDX-License-Identifier: Apache-2.0
// Each limit of what is said about a camera, just within it and just beyond.
#include "marrow/toolbox/calibration/plausibility.hpp"

#include <cmath>

#include "tests/harness/message_of.hpp"

namespace plausibility_test {

using namespace marrow;
using calibration::Device;
using Eigen::Vector3d, Eigen::Vector2d, Eigen::Matrix3d;

Camera right_camera() {
  const CArm arm{640, 512, {0.5, 0.5}, 1000, 600, Vector3d::Zero()};
  return carm_camera(arm, world_from_camera_rotation(radians(12), radians(35)));
}

/// Two points near the middle of the camera's image, about 600 mm from the source.
std::vector<Vector3d> object_seen_by(const Camera& camera) {
  const Vector3d source = source_position_mm(camera);
  const Vector2d middle(0.5 * camera.width_px, 0.5 * camera.height_px);
  return {source + 590 * ray_direction(camera, middle - Vector2d(20, 20)),
          source + 610 * ray_direction(camera, middle + Vector2d(20, 20))};
}

/// Whether one sentence with these words is found, and no other. If `object` is empty, the camera sees an object.
bool says(const std::string& words, const Camera& camera, const Device& device = {},
          std::vector<Vector3d> object = {}) {
  if (object.empty()) object = object_seen_by(camera);
  const auto sentences = calibration::implausible_numbers(camera, device, object);
  for (const std::string& sentence : sentences) EXPECT_HAS(sentence, words);
  EXPECT_LE(sentences.size(), 1u);
  return !sentences.empty();
}

Camera with_focal(double u, double v) {
  Camera camera = right_camera();
  camera.intrinsics(0, 0) = u;
  camera.intrinsics(1, 1) = v;
  return camera;
}

Camera with_principal(double u, double v) {
  Camera camera = right_camera();
  camera.intrinsics.topRightCorner<2, 1>() = Vector2d(u, v);
  return camera;
}

/// An object in the middle of the image, at this distance from the source and of this extent.
std::vector<Vector3d> object_at(double distance_mm, double extent_mm) {
  const Camera camera = right_camera();
  const Vector3d axis = camera.camera_from_world.rotation.row(2).transpose();
  const Vector3d middle = source_position_mm(camera) + distance_mm * axis;
  return {middle - 0.5 * extent_mm * axis, middle + 0.5 * extent_mm * axis};
}

double focal_of_angle(double angle_deg) { return 320 / std::tan(radians(0.5 * angle_deg)); }

TEST(Plausibility, AnglesOfTheImageAndPixelsThatAreSquareToATenth) {
  for (const auto& [angle, said] : {std::pair(59.9, false), {60.1, true}, {2.02, false}, {1.98, true}})
    EXPECT_EQ(says("opens an image of 640 px", with_focal(focal_of_angle(angle), focal_of_angle(angle))), said)
        << angle;
  for (const auto& [ratio, said] : {std::pair(1.095, false), {1.105, true}, {0.905, false}, {0.895, true}})
    EXPECT_EQ(says("so pixels would not be square", with_focal(2000 * ratio, 2000)), said) << ratio;
}

TEST(Plausibility, FocalLengthIsThatOfTheDeviceToATwentieth) {
  for (const auto& [ratio, said] : {std::pair(1.049, false), {1.051, true}, {0.951, false}, {0.949, true}})
    EXPECT_EQ(says("the pixels are scaled to the patient, or binned?", right_camera(), {1000, 0.5 * ratio, 0}), said)
        << ratio;
  EXPECT_FALSE(says("", right_camera(), {2000, 0, 0})) << "without the pixels' size nothing is known";
  EXPECT_FALSE(says("", right_camera(), {0, 5, 0}));
}

TEST(Plausibility, TheImageFitsOnTheDetectorToAFiftieth) {
  // 640 x 512 pixels of 0.5 mm.
  const auto of = [](double detector_mm, double pixel_mm, double source_to_detector_mm) {
    return says("the size of a pixel is too large, or the image was enlarged", right_camera(),
                {source_to_detector_mm, pixel_mm, detector_mm});
  };
  EXPECT_FALSE(of(320 / 1.019, 0.5, 0));
  EXPECT_TRUE(of(320 / 1.021, 0.5, 0));
  EXPECT_FALSE(of(320 / 1.019, 0, 1000)) << "the pixels' size by the focal length";
  EXPECT_TRUE(of(320 / 1.021, 0, 1000));
  EXPECT_FALSE(of(1, 0, 0));
  Camera upright = right_camera();
  std::swap(upright.width_px, upright.height_px);
  upright.intrinsics.topRightCorner<2, 1>() = Vector2d(255.5, 319.5);
  EXPECT_TRUE(says("256 x 320 mm at 0.5 mm per pixel", upright, {0, 0.5, 310})) << "the longer side counts";
}

TEST(Plausibility, PrincipalPoints) {
  for (const double factor : {0.25, 0.5, 2.0, 4.0}) {
    const std::string size = std::to_string(int(640 * factor)) + " x " + std::to_string(int(512 * factor));
    EXPECT_TRUE(says("lies in the middle of an image of " + size,
                     with_principal(320 * factor + 0.029 * factor * 640, 256 * factor)))
        << factor;
    EXPECT_TRUE(says("lies in the middle of an image of " + size,
                     with_principal(320 * factor, 256 * factor - 0.029 * factor * 512)))
        << factor;
    const auto beyond = calibration::implausible_numbers(
        with_principal(320 * factor + 0.031 * factor * 640, 256 * factor), {}, object_seen_by(right_camera()));
    for (const std::string& sentence : beyond)
      EXPECT_EQ(sentence.find("in the middle of an image of"), std::string::npos) << sentence;
  }
  EXPECT_FALSE(says("", with_principal(0.74 * 640, 0.26 * 512)));
  EXPECT_TRUE(says("lies far from the middle", with_principal(0.76 * 640, 0.5 * 512)));
  EXPECT_TRUE(says("lies far from the middle", with_principal(0.5 * 640, 0.24 * 512)));
  EXPECT_TRUE(says("lies far from the middle", with_principal(0.99 * 640, 0.6 * 512)));
  EXPECT_TRUE(says("lies outside the image", with_principal(1.01 * 640, 0.6 * 512)));
  EXPECT_TRUE(says("lies outside the image", with_principal(0.6 * 640, -1)));
}

TEST(Plausibility, SizesAndDistancesOfTheObject) {
  for (const auto& [extent, said] : {std::pair(3.1, false), {2.9, true}})
    EXPECT_EQ(says("are its coordinates in metres or centimetres?", right_camera(), {}, object_at(600, extent)), said)
        << extent;
  for (const auto& [extent, said] : {std::pair(2490.0, false), {2510.0, true}})
    EXPECT_EQ(says("are its coordinates in a smaller unit than mm?", right_camera(), {}, object_at(1600, extent)), said)
        << extent;
  for (const auto& [distance, said] : {std::pair(201.0, false), {199.0, true}, {4990.0, false}, {5010.0, true}})
    EXPECT_EQ(
        says("mm from the X-ray source, where C-arms have 300 to 1500", right_camera(), {}, object_at(distance, 50)),
        said)
        << distance;
  EXPECT_FALSE(says("", right_camera(), {}, {object_at(600, 0)[0]})) << "one point has no extent";
}

// The camera's source is 600 mm from the isocentre, which is the origin.
TEST(Plausibility, WithoutAnObjectItIsTakenToBeNearTheOrigin) {
  const auto said = [](double factor) {
    Camera camera = right_camera();
    camera.camera_from_world.translation_mm *= factor;
    const auto sentences = calibration::implausible_numbers(camera, {}, {});
    return sentences.empty() ? std::string() : sentences[0];
  };
  EXPECT_EQ(said(1), "");
  EXPECT_EQ(said(0.1),
            "the X-ray source is 60 mm from the world's origin, where devices have 200 to 5000; looks like cm: give "
            "scale: 10");
  EXPECT_EQ(said(0.001),
            "the X-ray source is 0.6 mm from the world's origin, where devices have 200 to 5000; looks like m: give "
            "scale: 1000");
  EXPECT_EQ(said(0), "") << "the camera is the world";
}

TEST(Plausibility, NamesTheUnitOfTheDistanceFromTheObject) {
  Camera camera = right_camera();
  camera.camera_from_world.translation_mm *= 0.1;
  const auto sentences = calibration::implausible_numbers(camera, {}, {{-1, -1, -2}, {1, 1, 2}});
  ASSERT_EQ(sentences.size(), 1u);
  EXPECT_EQ(
      sentences[0],
      "the object is 60 mm from the X-ray source, where C-arms have 300 to 1500; the camera's translation, or the "
      "object, seems to be in another unit than mm; looks like cm: give scale: 10");
}

TEST(Plausibility, ObjectsBehindTheSourceOrBesideTheImage) {
  const std::vector<Vector3d> behind = object_at(-600, 50);
  std::vector<Vector3d> one = object_seen_by(right_camera());
  one.push_back(source_position_mm(right_camera()) -
                10 * Vector3d(right_camera().camera_from_world.rotation.row(2).transpose()));
  EXPECT_TRUE(says("1 of 3 points of the object lie behind the X-ray source", right_camera(), {}, one));
  EXPECT_TRUE(says("2 of 2 points of the object lie behind the X-ray source", right_camera(), {}, behind));
  // Just beside the image: one pixel further in would be inside.
  const Camera camera = right_camera();
  const auto at = [&](double u, double v) {
    return Vector3d(source_position_mm(camera) + 600 * ray_direction(camera, {u, v}));
  };
  const auto is_said = [&](const std::vector<Vector3d>& object) {
    return says("the object is projected wholly outside the image", camera, {}, object);
  };
  for (const auto& [u, v] : {std::pair(-1.5, 200.0), {640.5, 200.0}, {300.0, -1.5}, {300.0, 512.5}}) {
    EXPECT_TRUE(is_said({at(u, v), at(u, v) + 5 * (at(u, v) - at(320, 256)).normalized()})) << u << ", " << v;
    EXPECT_FALSE(is_said({at(u, v), at(320, 256)})) << "a part is seen";
  }
  for (const auto& [u, v] : {std::pair(-0.5, 200.0), {639.5, 200.0}, {300.0, -0.5}, {300.0, 511.5}})
    EXPECT_FALSE(is_said({at(u, v), at(u, v) + 5 * (at(u, v) - at(320, 256)).normalized()})) << u << ", " << v;
}

// The numbers that the sentences name.
TEST(Plausibility, SaysTheNumbers) {
  const std::string middle = "lies in the middle of an image of ", size = " pixels, but this one has 640 x 512";
  EXPECT_TRUE(says("the focal length of 100 px opens an image of 640 px to 145.3 degrees", with_focal(100, 100)));
  EXPECT_TRUE(says(middle + "1280 x 1024" + size, with_principal(639.5, 511.5)));
  EXPECT_TRUE(says(middle + "320 x 256" + size, with_principal(160, 128)));
  EXPECT_TRUE(says("the principal point (-30, 256) lies outside the image", with_principal(-30, 256)));
  EXPECT_TRUE(says("the focal length is 2000 px, but 1000 mm from source to detector and pixels of 0.3 mm make 3333",
                   right_camera(), {1000, 0.3, 0}));
  EXPECT_TRUE(says("the detector is 200 mm wide, smaller than the image says: 320 x 256 mm at 0.5 mm per pixel",
                   right_camera(), {0, 0.5, 200}));
  EXPECT_TRUE(says("the detector is 200 mm wide, smaller than the image says", right_camera(), {1000, 0, 200}));
  EXPECT_TRUE(
      says("the object is 0.1 mm large; are its coordinates in metres", right_camera(), {}, object_at(600, 0.1)));
  Camera camera = right_camera();
  EXPECT_TRUE(calibration::implausible_numbers(camera, {1000, 0.5, 330}, object_at(600, 80)).empty());
  EXPECT_TRUE(calibration::implausible_numbers(camera, {}, {}).empty());
  camera.camera_from_world.translation_mm *= 0.001;
  const std::vector<Vector3d> object{{-40, -40, -40}, {40, 40, 40}};
  std::string all;
  for (const std::string& sentence : calibration::implausible_numbers(camera, {}, object)) all += sentence + "\n";
  EXPECT_HAS(all, "the object is 0.6 mm from the X-ray source");
}

}  // namespace plausibility_test
