// SPDX-License-Identifier: Apache-2.0
// A camera from marked points: exact without noise, as exact as its deviations say with noise, refused where the points
// do not determine it. And the epipolar distances of camera.check, by hand.

#include <cmath>
#include <random>
#include <sstream>

#include "marrow/domain/c_arm.hpp"
#include "shipped.hpp"
#include "tests/plugins/read/files.hpp"

namespace points_test {

using namespace marrow;
using namespace marrow::test;
using Eigen::Vector3d, Eigen::Vector2d, Eigen::Matrix3d;
using CameraCheck = InAFolder;

Camera a_camera() {
  CArm arm{1000, 900, {0.3, 0.3}, 1100, 700, Vector3d(5, -8, 3)};
  Camera camera = carm_camera(arm, world_from_camera_rotation(radians(11.0), radians(-37.0)));
  camera.intrinsics(0, 2) += 14;
  camera.intrinsics(1, 2) -= 9;
  return camera;
}

std::vector<Vector3d> box_points(int count, double depth_mm, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> place(-1, 1);
  std::vector<Vector3d> points;
  for (int i = 0; i < count; ++i) points.emplace_back(60 * place(random), depth_mm * place(random), 60 * place(random));
  return points;
}

std::string points_text(const Camera& camera, const std::vector<Vector3d>& points, double noise_px, std::uint64_t seed,
                        bool mirrored = false) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> noise(0, 1);
  std::ostringstream text;
  text.precision(17);
  text << "marrow-points: 1\npoints:\n";
  for (const Vector3d& point : points) {
    Vector2d pixel = project(camera, point) + noise_px * Vector2d(noise(random), noise(random));
    if (mirrored) pixel.x() = camera.width_px - 1 - pixel.x();
    text << "  - {at_mm: [" << point.x() << ", " << point.y() << ", " << point.z() << "], seen_px: {a: [" << pixel.x()
         << ", " << pixel.y() << "]}}\n";
  }
  return text.str();
}

struct Answer {
  Camera camera;
  std::map<std::string, double> figures;
};

shipped::Options options_of(const TemporaryFolder& folder, const std::string& unknown) {
  return {{"known_points", (folder / "p.yaml").string()},
          {"view", std::string("a")},
          {"width_px", 1000},
          {"height_px", 900},
          {"unknown", unknown}};
}

Answer answer(const std::string& text, const std::string& unknown, const Camera* known = nullptr) {
  const TemporaryFolder folder;
  put(folder / "p.yaml", text);
  shipped::Inputs inputs;
  if (known) inputs["camera"] = shipped::item(*known);
  const auto outputs = shipped::call("camera.points", inputs, options_of(folder, unknown));
  Answer answer{outputs.at("camera").as<Camera>(), {}};
  for (const Metric& metric : outputs.at("metrics").as<Metrics>().items) answer.figures[metric.name] = metric.value;
  return answer;
}

void expect_same(const Camera& found, const Camera& truth, double tolerance) {
  EXPECT_LT((found.intrinsics - truth.intrinsics).cwiseAbs().maxCoeff(), 1000 * tolerance) << found.intrinsics;
  EXPECT_LT((found.camera_from_world.rotation - truth.camera_from_world.rotation).cwiseAbs().maxCoeff(), tolerance);
  EXPECT_LT((source_position_mm(found) - source_position_mm(truth)).norm(), 1000 * tolerance);
}

TEST(CameraPoints, ExactPointsGiveTheCamera) {
  const Camera truth = a_camera();
  for (const std::uint64_t seed : {1, 2, 3}) {
    expect_same(answer(points_text(truth, box_points(6, 50, seed), 0, 1), "all").camera, truth, 1e-6);
    expect_same(answer(points_text(truth, box_points(4, 50, seed), 0, 1), "pose", &truth).camera, truth, 1e-6);
    expect_same(answer(points_text(truth, box_points(6, 0, seed), 0, 1), "pose", &truth).camera, truth, 1e-6);
    Camera longer = truth;
    longer.intrinsics.topLeftCorner<2, 2>() *= 1.1;
    expect_same(answer(points_text(truth, box_points(7, 50, seed), 0, 1), "focal_length", &longer).camera, truth, 1e-6);
  }
}

// Over many draws of the noise, an error is as large as its deviation says: 68 % of a normal distribution lie within
// one deviation, and the mean square of the ratio is 1. Deviations from 18 points are themselves uncertain.
TEST(CameraPoints, DeviationsAreThoseOfTheErrors) {
  const Camera truth = a_camera();
  std::map<std::string, double> squares;
  constexpr int kDraws = 150;
  for (int draw = 0; draw < kDraws; ++draw) {
    const Answer found = answer(points_text(truth, box_points(18, 50, 7), 0.3, 100 + std::uint64_t(draw)), "all");
    const auto add = [&](const std::string& name, double error) {
      squares[name] += std::pow(error / found.figures.at(name), 2) / kDraws;
    };
    add("predicted_focal_length_px", found.camera.intrinsics(0, 0) - truth.intrinsics(0, 0));
    add("predicted_centre_u_px", found.camera.intrinsics(0, 2) - truth.intrinsics(0, 2));
    add("predicted_centre_v_px", found.camera.intrinsics(1, 2) - truth.intrinsics(1, 2));
    // The motion of the camera's frame that leads from the found camera to the true one.
    const Matrix3d turn = truth.camera_from_world.rotation * found.camera.camera_from_world.rotation.transpose();
    const Vector3d shift =
        truth.camera_from_world.translation_mm - turn * found.camera.camera_from_world.translation_mm;
    const Vector3d angle = vector_from_rotation(turn) * (180 / EIGEN_PI);
    for (int k = 0; k < 3; ++k) {
      const std::string axis = k == 0 ? "u" : k == 1 ? "v" : "depth";
      add("predicted_rotation_" + axis + "_deg", angle[k]);
      add("predicted_shift_" + axis + "_mm", shift[k]);
    }
  }
  EXPECT_EQ(squares.size(), 9u);
  for (const auto& [name, square] : squares) {
    EXPECT_GT(square, 0.6) << name;
    EXPECT_LT(square, 1.7) << name;
  }
}

std::string refusal(const std::string& text, const std::string& unknown, const std::string& view = "a") {
  const TemporaryFolder folder;
  put(folder / "p.yaml", text);
  shipped::Options options = options_of(folder, unknown);
  options["view"] = view;
  return shipped::refusal("camera.points", {}, options);
}

TEST(CameraPoints, WhatDoesNotDetermineACamera) {
  const Camera truth = a_camera();
  const auto expect = [](const std::string& said, const std::string& part) {
    EXPECT_NE(said.find(part), std::string::npos) << part << "\nit said:\n" << said;
  };
  expect(refusal(points_text(truth, box_points(5, 50, 1), 0, 1), "all"),
         "5 points have a place in the world (at_mm) and are seen in this view; at least 6 are needed, or 4 if the "
         "camera's inner parameters are known (unknown: pose)");
  expect(refusal(points_text(truth, box_points(12, 0, 1), 0, 1), "all"),
         "the points lie nearly in one plane, so one image does not tell the focal length from the distance");
  std::vector<Vector3d> line;
  for (int i = 0; i < 8; ++i) line.emplace_back(i * 10, 0, i * 5);
  expect(refusal(points_text(truth, line, 0, 1), "all"), "the points lie nearly on a line");
  expect(refusal(points_text(truth, box_points(9, 50, 1), 0, 1, true), "all"),
         "only the mirrored image shows the points like this");
  expect(refusal(points_text(truth, box_points(9, 50, 1), 0, 1), "pose"),
         "with unknown: pose the inner parameters must be known; wire a camera that has them");
  expect(refusal(points_text(truth, box_points(9, 50, 1), 0, 1), "all", "b"), "view: no point is seen in 'b'");
}

// Two cameras 90 degrees apart about the vertical axis, whose rows agree: epipolar lines of points near the centre are
// nearly rows. A point that is marked 3 px too low in one image lies nearly 3 px from its line in both.
TEST_F(CameraCheck, EpipolarDistances) {
  const CArm arm{1000, 1000, {0.3, 0.3}, 1100, 700, Vector3d::Zero()};
  List<View> views;
  for (const double beta : {0.0, 90.0}) {
    View view;
    view.name = beta == 0 ? "a" : "b";
    view.image.pixels = cv::Mat(1000, 1000, CV_8U, cv::Scalar(100));
    view.camera = carm_camera(arm, world_from_camera_rotation(0, radians(beta)));
    views.add(view.name, view);
  }
  for (const double off_px : {0.0, 3.0}) {
    std::ostringstream text;
    text.precision(17);
    text << "marrow-points: 1\npoints:\n";
    for (const Vector3d& point : {Vector3d(1, 2, 3), Vector3d(-4, 1, -2), Vector3d(3, -3, 1)}) {
      const Vector2d a = project(views[0].camera, point), b = project(views[1].camera, point);
      text << "  - {seen_px: {a: [" << a.x() << ", " << a.y() << "], b: [" << b.x() << ", " << b.y() + off_px
           << "]}}\n";
    }
    put(folder / "p.yaml", text.str());
    const shipped::Inputs inputs{{"views", shipped::list(views, "view")}};
    const auto outputs = shipped::call("camera.check", inputs, {{"known_points", (folder / "p.yaml").string()}});
    double found = -1;
    for (const Metric& metric : outputs.at("metrics").as<Metrics>().items)
      if (metric.name == "a-b.epipolar") found = metric.value;
    EXPECT_NEAR(found, off_px, off_px == 0 ? 1e-9 : 0.06);
  }
}

}  // namespace points_test
