// SPDX-License-Identifier: Apache-2.0
// Each limit of what is said about a camera, just within it and just beyond.
#include "marrow/toolbox/calibration/plausibility.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "marrow/domain/c_arm.hpp"

namespace plausibility_test {

using namespace marrow;
using calibration::Device;
using calibration::SeenPoints;
using Eigen::Vector2d;
using Eigen::Vector3d;

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
  for (const std::string& sentence : sentences) EXPECT_NE(sentence.find(words), std::string::npos) << sentence;
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

/// Points spread over the field, exactly where they should be seen.
SeenPoints points_of(const Camera& camera, int count = 20) {
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> place(-45, 45);
  SeenPoints points;
  for (int i = 0; i < count; ++i) {
    points.world_mm.emplace_back(place(random), place(random), place(random));
    points.pixels.push_back(project(camera, points.world_mm.back()));
  }
  return points;
}

/// The explanation for one view alone.
std::optional<std::string> explanation(const Camera& camera, const SeenPoints& points) {
  return calibration::explanations({camera}, {points}).at(0);
}

TEST(Plausibility, AnglesOfTheImage) {
  for (const auto& [angle, said] : {std::pair(59.9, false), {60.1, true}, {2.02, false}, {1.98, true}})
    EXPECT_EQ(says("opens an image of 640 px", with_focal(focal_of_angle(angle), focal_of_angle(angle))), said)
        << angle;
}

TEST(Plausibility, PixelsAreSquareToATenth) {
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

TEST(Reprojection, IsTheRootMeanSquareOfDistances) {
  const Camera camera = right_camera();
  SeenPoints points = points_of(camera, 4);
  EXPECT_NEAR(calibration::reprojection_error_px(camera, points), 0, 1e-9);
  points.pixels[1] += Vector2d(3, 4);
  points.pixels[2] -= Vector2d(0, 10);
  EXPECT_NEAR(calibration::reprojection_error_px(camera, points), std::sqrt(125.0 / 4), 1e-9);
  points.world_mm[3] = source_position_mm(camera) - 10 * Vector3d(camera.camera_from_world.rotation.row(2).transpose());
  EXPECT_EQ(calibration::reprojection_error_px(camera, points), std::numeric_limits<double>::infinity());
  EXPECT_EQ(calibration::reprojection_error_px(camera, {}), 0);
}

TEST(Explanation, OfEveryUnit) {
  const Camera right = right_camera();
  for (const auto& [unit, factor] : std::vector<std::pair<std::string, double>>{
           {"metres", 1000}, {"centimetres", 10}, {"inches", 25.4}, {"micrometres", 0.001}}) {
    SeenPoints points = points_of(right);
    for (auto& point : points.world_mm) point /= factor;
    auto sentence = explanation(right, points);
    ASSERT_TRUE(sentence) << unit;
    EXPECT_TRUE(sentence->ends_with("if the points are in " + unit + ", not mm")) << *sentence;
    Camera camera = right;
    camera.camera_from_world.translation_mm /= factor;
    sentence = explanation(camera, points_of(right));
    ASSERT_TRUE(sentence) << unit;
    EXPECT_TRUE(sentence->ends_with("if the camera's translation is in " + unit + ", not mm")) << *sentence;
  }
  Camera twice = right;
  twice.intrinsics.topRows<2>() *= 2;
  twice.intrinsics.topRightCorner<2, 1>().array() += 0.5;
  EXPECT_TRUE(
      explanation(twice, points_of(right))
          ->ends_with("if the camera matrix is that of an image twice as large; multiply its first two rows by 0.5, "
                      "and then subtract 0.25 from the principal point"));
}

/// The remaining error that a sentence states.
double left_px(const std::string& sentence) { return std::stod(sentence.substr(sentence.find("only ") + 5)); }

// Pixel u of the smaller image covers two pixels of the larger one, with the middles 2 u and 2 u + 1. So place u in the
// smaller image is place 2 u + 0.5 in the larger one, and place v in the larger one is (v - 0.5) / 2 in the smaller.
TEST(Explanation, SizesOfImagesAreSaidToTheHalfPixel) {
  const Camera right = right_camera();
  Camera half = right, twice = right;
  Eigen::Matrix3d smaller, larger;
  smaller << 0.5, 0, -0.25, 0, 0.5, -0.25, 0, 0, 1;
  larger << 2, 0, 0.5, 0, 2, 0.5, 0, 0, 1;
  half.intrinsics = smaller * right.intrinsics;
  twice.intrinsics = larger * right.intrinsics;
  const auto of_half = explanation(half, points_of(right)), of_twice = explanation(twice, points_of(right));
  ASSERT_TRUE(of_half && of_twice);
  EXPECT_TRUE(
      of_half->ends_with("if the camera matrix is that of an image half as large; multiply its first two rows "
                         "by 2, and then add 0.5 to the principal point"))
      << *of_half;
  EXPECT_LT(left_px(*of_half), 1e-6);
  EXPECT_LT(left_px(*of_twice), 1e-6) << *of_twice;
}

/// Cameras that look along y and along x, with the principal point in the middle of the image.
std::vector<Camera> crossed_cameras() {
  std::vector<Camera> cameras;
  for (const double beta : {0.0, 90.0}) {
    const CArm arm{640, 512, {0.5, 0.5}, 1000, 600, Vector3d::Zero()};
    cameras.push_back(carm_camera(arm, world_from_camera_rotation(0, radians(beta))));
  }
  return cameras;
}

// In a view along y, a mirrored image looks like points whose x axis is reversed. In a view along x, it looks like
// points whose y axis is reversed. Only the mirrored image is the same mistake in both.
TEST(Explanation, MirroredImagesAreNotReversedPoints) {
  const std::vector<Camera> cameras = crossed_cameras();
  std::vector<SeenPoints> mirrored;
  for (const Camera& camera : cameras) {
    mirrored.push_back(points_of(camera));
    for (Vector2d& pixel : mirrored.back().pixels) pixel.x() = 639 - pixel.x();
  }
  for (const auto& sentence : calibration::explanations(cameras, mirrored)) {
    ASSERT_TRUE(sentence);
    EXPECT_TRUE(sentence->ends_with("if the image is mirrored left to right; mirror it back")) << *sentence;
  }
  const std::vector<SeenPoints> one{points_of(cameras[0]), mirrored[1]};
  const auto of_one = calibration::explanations(cameras, one);
  EXPECT_FALSE(of_one[0]);
  ASSERT_TRUE(of_one[1]);
  EXPECT_TRUE(of_one[1]->ends_with("if the image is mirrored left to right; mirror it back")) << *of_one[1];
}

// Points with a reversed axis are the same points in both views. The view along this axis sees them nearer or farther.
TEST(Explanation, ReversedPointsAreNotMirroredImages) {
  const std::vector<Camera> cameras = crossed_cameras();
  std::vector<SeenPoints> reversed;
  for (const Camera& camera : cameras) {
    reversed.push_back(points_of(camera));
    for (Vector3d& point : reversed.back().world_mm) point.x() = -point.x();
  }
  const auto sentences = calibration::explanations(cameras, reversed);
  ASSERT_TRUE(sentences[0]);
  EXPECT_TRUE(sentences[0]->ends_with("if the x axis of the points is reversed")) << *sentences[0];
  EXPECT_TRUE(!sentences[1] || sentences[1]->ends_with("if the x axis of the points is reversed")) << *sentences[1];
}

TEST(Explanation, OnlyOfWhatIsFarOffAndThenMuchBetter) {
  const Camera right = right_camera();
  // Mirrored, and each point is off by `noise_px` in addition. 6.4 px are 1 % of the image width, 12.8 px are 2 %.
  const auto mirrored = [&](double noise_px, int count = 20) {
    SeenPoints points = points_of(right, count);
    for (std::size_t i = 0; i < points.pixels.size(); ++i)
      points.pixels[i] = Vector2d(639 - points.pixels[i].x(), points.pixels[i].y() + (i % 2 ? noise_px : -noise_px));
    return points;
  };
  EXPECT_TRUE(explanation(right, mirrored(0)));
  EXPECT_TRUE(explanation(right, mirrored(12.5))) << "what is left may be a fiftieth of the image";
  EXPECT_FALSE(explanation(right, mirrored(13.1)));
  EXPECT_TRUE(explanation(right, mirrored(0, 4)));
  EXPECT_FALSE(explanation(right, mirrored(0, 3)));
  // Points near the mirror line move little, by off_px. A part of this, rest_px, remains after mirroring them back.
  const auto near_line = [&](double off_px, double rest_px) {
    SeenPoints points = points_of(right);
    for (std::size_t i = 0; i < points.pixels.size(); ++i) {
      const double side = i % 2 ? 1 : -1;
      points.world_mm[i] =
          source_position_mm(right) + 600 * ray_direction(right, {319.5 - 0.5 * off_px * side, points.pixels[i].y()});
      points.pixels[i] = Vector2d(319.5 + 0.5 * off_px * side, points.pixels[i].y() + (i % 4 < 2 ? rest_px : -rest_px));
    }
    return points;
  };
  EXPECT_TRUE(explanation(right, near_line(6.5, 0)));
  EXPECT_FALSE(explanation(right, near_line(6.3, 0))) << "less than a hundredth of the image is no mistake";
  EXPECT_TRUE(explanation(right, near_line(10, 2))) << "five times better: sqrt(104) to 2";
  EXPECT_FALSE(explanation(right, near_line(10, 2.1)));
}

TEST(Refit, NeedsSixPoints) {
  const Camera right = right_camera();
  Camera moved = right;
  moved.camera_from_world.translation_mm.x() += 4;
  EXPECT_FALSE(calibration::refit_pose(moved, points_of(right, 5)));
  const auto refit = calibration::refit_pose(moved, points_of(right, 6));
  ASSERT_TRUE(refit);
  EXPECT_LT(refit->error_px, 1e-3);
  EXPECT_NEAR(refit->turn_deg, 0, 1e-3);
  EXPECT_NEAR(refit->shift_mm, 4, 1e-3);
}

}  // namespace plausibility_test
