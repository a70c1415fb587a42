// SPDX-License-Identifier: Apache-2.0
// Mistakes that explain why points are seen elsewhere: each is named, and none where it would explain little.
#include <cmath>
#include <random>

#include "marrow/toolbox/calibration/plausibility.hpp"
#include "tests/plugins/read/files.hpp"

namespace explanation_test {

using namespace marrow;
using calibration::SeenPoints;
using Eigen::Vector2d, Eigen::Vector3d;

Camera camera_at(double alpha_deg, double beta_deg) {
  const CArm arm{640, 512, {0.5, 0.5}, 1000, 600, Vector3d::Zero()};
  return carm_camera(arm, world_from_camera_rotation(radians(alpha_deg), radians(beta_deg)));
}
Camera right_camera() { return camera_at(12, 35); }
Camera with_odd_centre(Camera camera) {
  camera.intrinsics(0, 2) += 9;
  camera.intrinsics(1, 2) -= 6;
  return camera;
}

/// Points spread over the field, where they should be seen but for this noise.
SeenPoints points_of(const Camera& camera, int count = 20, double noise_px = 0) {
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> place(-45, 45);
  std::normal_distribution<double> noise(0, 1);
  SeenPoints points;
  for (int i = 0; i < count; ++i) {
    points.world_mm.emplace_back(place(random), place(random), place(random));
    points.pixels.push_back(project(camera, points.world_mm.back()) +
                            noise_px * Vector2d(noise(random), noise(random)));
  }
  return points;
}

/// The explanation for one view alone.
std::optional<std::string> explanation(const Camera& camera, const SeenPoints& points) {
  return calibration::explanations({camera}, {points}).at(0);
}

/// The remaining error that a sentence states.
double left_px(const std::string& sentence) {
  const std::size_t at = sentence.find("only ");
  return at == std::string::npos ? 1e9 : std::stod(sentence.substr(at + 5));
}

/// A mistake, and the end of the sentence or words of it.
struct Mistake {
  std::string said;
  std::function<void(Camera&, SeenPoints&)> make;
};

void expect_explained(const Mistake& mistake, bool to_the_end) {
  Camera camera = with_odd_centre(right_camera());
  SeenPoints points = points_of(camera, 20, 0.2);
  mistake.make(camera, points);
  const auto sentence = explanation(camera, points);
  ASSERT_TRUE(sentence) << mistake.said;
  EXPECT_TRUE(to_the_end ? sentence->ends_with(mistake.said) : sentence->find(mistake.said) != std::string::npos)
      << mistake.said << "; it said: " << *sentence;
  EXPECT_LT(left_px(*sentence), 0.4) << "but for the noise, nothing is left: " << *sentence;
}

TEST(Explanation, NoneForARightCamera) {
  for (const double beta : {0.0, 35.0, 90.0}) {
    const Camera camera = with_odd_centre(camera_at(12, beta));
    EXPECT_FALSE(explanation(camera, points_of(camera, 20, 0.2)));
    EXPECT_NEAR(calibration::reprojection_error_px(camera, points_of(camera, 20, 0.2)), 0.2 * std::sqrt(2), 0.1);
  }
}

TEST(Explanation, OfImagesPointsAndPoses) {
  const auto pixels = [](auto change) {
    return [=](Camera&, SeenPoints& points) {
      for (Vector2d& p : points.pixels) change(p);
    };
  };
  const auto places = [](auto change) {
    return [=](Camera&, SeenPoints& points) {
      for (Vector3d& p : points.world_mm) change(p);
    };
  };
  const auto pose = [](auto change) { return [=](Camera& camera, SeenPoints&) { change(camera.camera_from_world); }; };
  for (const Mistake& mistake : std::vector<Mistake>{
           {"the image is mirrored left to right", pixels([](Vector2d&p) { p.x() = 639 - p.x(); })},
           {"the image is upside down", pixels([](Vector2d&p) { p.y() = 511 - p.y(); })},
           {"the image is turned by a half", pixels([](Vector2d&p) { p = Vector2d(639, 511) - p; })},
           {"columns and rows of the seen places are exchanged", pixels([](Vector2d&p) { std::swap(p.x(), p.y()); })},
           {"the x axis of the points is reversed", places([](Vector3d&p) { p.x() = -p.x(); })},
           {"the y axis of the points is reversed", places([](Vector3d&p) { p.y() = -p.y(); })},
           {"the z axis of the points is reversed", places([](Vector3d&p) { p.z() = -p.z(); })},
           {"RAS in place of LPS", places([](Vector3d&p) { p = Vector3d(-p.x(), -p.y(), p.z()); })},
           {"the camera's pose is given the other way round (world from camera)",
            pose([](RigidTransform&t) { t = inverse(t); })},
           {"the camera's rotation is transposed", pose([](RigidTransform&t) { t.rotation.transposeInPlace(); })},
           {"the camera's translation is the source's position",
            [](Camera&camera, SeenPoints&) { camera.camera_from_world.translation_mm = source_position_mm(camera); }},
           {"OpenGL's convention", pose([](RigidTransform&t) {
              t.rotation = Vector3d(1, -1, -1).asDiagonal() * t.rotation;
              t.translation_mm = Vector3d(1, -1, -1).cwiseProduct(t.translation_mm);
            })}})
    expect_explained(mistake, false);
  for (const auto& [unit, factor] :
       {std::pair{"metres", 1000.0}, {"centimetres", 10.0}, {"inches", 25.4}, {"micrometres", 0.001}}) {
    const std::string end = std::string(unit) + ", not mm";
    expect_explained({"if the points are in " + end, places([&](Vector3d& p) { p /= factor; })}, true);
    expect_explained(
        {"if the camera's translation is in " + end, pose([&](RigidTransform& t) { t.translation_mm /= factor; })},
        true);
  }
}

// Pixel u of the smaller image covers two pixels of the larger one, with the middles 2 u and 2 u + 1. So place u in the
// smaller image is place 2 u + 0.5 in the larger one, and place v in the larger one is (v - 0.5) / 2 in the smaller.
TEST(Explanation, SizesOfImagesAreSaidToTheHalfPixel) {
  for (const auto& [factor, shift, said] :
       {std::tuple{0.5, -0.25,
                   "half as large; multiply its first two rows by 2, and then add 0.5 to the principal point"},
        {2.0, 0.5,
         "twice as large; multiply its first two rows by 0.5, and then subtract 0.25 from the principal point"}}) {
    Camera camera = right_camera();
    camera.intrinsics.topRows<2>() *= factor;
    camera.intrinsics.topRightCorner<2, 1>().array() += shift;
    const auto sentence = explanation(camera, points_of(right_camera()));
    ASSERT_TRUE(sentence);
    EXPECT_TRUE(sentence->ends_with(std::string("if the camera matrix is that of an image ") + said)) << *sentence;
    EXPECT_LT(left_px(*sentence), 1e-6) << *sentence;
  }
}

// In a view along y, a mirrored image looks like points whose x axis is reversed. In a view along x, it looks like
// points whose y axis is reversed. Only the mirrored image is the same mistake in both.
TEST(Explanation, MirroredImagesAreNotReversedPoints) {
  const std::vector<Camera> cameras{camera_at(0, 0), camera_at(0, 90)};
  std::vector<SeenPoints> mirrored;
  for (const Camera& camera : cameras) {
    mirrored.push_back(points_of(camera));
    for (Vector2d& pixel : mirrored.back().pixels) pixel.x() = 639 - pixel.x();
  }
  const std::string said = "if the image is mirrored left to right; mirror it back";
  for (const auto& sentence : calibration::explanations(cameras, mirrored)) {
    ASSERT_TRUE(sentence);
    EXPECT_TRUE(sentence->ends_with(said)) << *sentence;
  }
  const auto of_one = calibration::explanations(cameras, {points_of(cameras[0]), mirrored[1]});
  EXPECT_FALSE(of_one[0]);
  ASSERT_TRUE(of_one[1]);
  EXPECT_TRUE(of_one[1]->ends_with(said)) << *of_one[1];
}

// Points with a reversed axis are the same points in both views. The view along this axis sees them nearer or farther.
TEST(Explanation, ReversedPointsAreNotMirroredImages) {
  const std::vector<Camera> cameras{camera_at(0, 0), camera_at(0, 90)};
  std::vector<SeenPoints> reversed;
  for (const Camera& camera : cameras) {
    reversed.push_back(points_of(camera));
    for (Vector3d& point : reversed.back().world_mm) point.x() = -point.x();
  }
  const auto sentences = calibration::explanations(cameras, reversed);
  const std::string said = "if the x axis of the points is reversed";
  ASSERT_TRUE(sentences[0]);
  EXPECT_TRUE(sentences[0]->ends_with(said)) << *sentences[0];
  EXPECT_TRUE(!sentences[1] || sentences[1]->ends_with(said)) << *sentences[1];
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

TEST(Refit, TellsAMovedPoseFromAWrongMatrixByAtLeastSixPoints) {
  const Camera right = right_camera();
  Camera moved = right;
  moved.camera_from_world.translation_mm += Vector3d(3, -2, 0);
  moved.camera_from_world.rotation = rotation_from_vector({0, 0, radians(1.5)}) * right.camera_from_world.rotation;
  auto refit = calibration::refit_pose(moved, points_of(right, 20, 0.2));
  ASSERT_TRUE(refit);
  EXPECT_LT(refit->error_px, 0.4);
  EXPECT_NEAR(refit->turn_deg, 1.5, 0.1);
  EXPECT_NEAR(refit->shift_mm, 3.6, 0.5);
  moved = right;
  moved.camera_from_world.translation_mm.x() += 4;
  EXPECT_FALSE(calibration::refit_pose(moved, points_of(right, 5)));
  refit = calibration::refit_pose(moved, points_of(right, 6));
  ASSERT_TRUE(refit);
  EXPECT_LT(refit->error_px, 1e-3);
  EXPECT_NEAR(refit->turn_deg, 0, 1e-3);
  EXPECT_NEAR(refit->shift_mm, 4, 1e-3);
}

}  // namespace explanation_test
