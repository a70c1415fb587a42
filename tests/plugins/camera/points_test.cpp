// SPDX-License-Identifier: Apache-2.0
// A camera from marked points: exact without noise, as exact as its deviations say with noise, refused where the points
// do not determine it. And the epipolar distances of camera.check, by hand.
// Cameras of a C-arm's angles and of matrices; and calibrations that determine their focal length well, hardly, or not
// at all.

#include <random>
#include <sstream>

#include "marrow/toolbox/calibration/plausibility.hpp"
#include "shipped.hpp"
#include "tests/plugins/read/files.hpp"

namespace points_test {

using namespace marrow;
using namespace marrow::test;
using Eigen::Vector3d, Eigen::Vector2d, Eigen::Matrix3d;
using CameraCheck = InAFolder;
using Numbers = std::vector<double>;

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
    EXPECT_HAS(said, part) << part << "\nit said:\n" << said;
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

Camera view(double alpha_deg, double beta_deg, shipped::Options options = {}) {
  options["names"] = std::vector<std::string>{"one"};
  options["alpha_deg"] = std::vector<double>{alpha_deg};
  options["beta_deg"] = std::vector<double>{beta_deg};
  return shipped::call("camera.carm", {}, options).at("camera").as_list<Camera>()[0];
}

Vector3d towards_detector(const Camera& camera) { return camera.camera_from_world.rotation.row(2); }

TEST(CarmCamera, FrontalLooksFromTheSourceAndBetaTurnsTheDetectorToThePatientsLeft) {
  const Camera frontal = view(0, 0);
  EXPECT_TRUE(towards_detector(frontal).isApprox(-Vector3d::UnitY()));
  const Vector2d centre = project(frontal, Vector3d::Zero());
  EXPECT_LT(project(frontal, {0, 0, 50}).y(), centre.y()) << "the head is up";
  EXPECT_LT(project(frontal, {50, 0, 0}).x(), centre.x()) << "seen from the source, the patient's left is on the left";
  EXPECT_TRUE(towards_detector(view(0, 90)).isApprox(Vector3d::UnitX()));
  EXPECT_TRUE(towards_detector(view(0, -90)).isApprox(-Vector3d::UnitX()));
  EXPECT_TRUE(towards_detector(view(0, 30)).isApprox(Vector3d(0.5, -std::sqrt(0.75), 0), 1e-12));
  // A point in front of the isocentre: as the detector goes left and the source right, its image moves to +u.
  EXPECT_GT(project(view(0, 20), {0, -50, 0}).x(), project(view(0, 0), {0, -50, 0}).x());
}

TEST(CarmCamera, AlphaTiltsTheDetectorTowardsTheHeadAndBothAnglesFollowTheFormula) {
  EXPECT_TRUE(towards_detector(view(90, 0)).isApprox(Vector3d::UnitZ()));
  EXPECT_TRUE(towards_detector(view(20, 0)).isApprox(Vector3d(0, -std::cos(radians(20)), std::sin(radians(20)))));
  // The source is then towards the feet, so a point in front of the isocentre lies below the central ray: v grows.
  EXPECT_GT(project(view(20, 0), {0, -50, 0}).y(), project(view(0, 0), {0, -50, 0}).y());
  const double s = radians(25), p = radians(-40);
  const Vector3d expected(std::sin(p) * std::cos(s), -std::cos(p) * std::cos(s), std::sin(s));
  EXPECT_TRUE(towards_detector(view(25, -40)).isApprox(expected, 1e-12));
}

TEST(CarmCamera, IsocentreProjectsToTheMiddleOfTheDetectorInEveryView) {
  const Vector3d isocentre_mm(12, -7, 300);
  const shipped::Options options{{"isocentre_mm", std::vector<double>{12, -7, 300}},
                                 {"width_px", std::int64_t{1024}},
                                 {"height_px", std::int64_t{768}}};
  for (double alpha : {-30.0, 0.0, 45.0})
    for (double beta : {-120.0, 0.0, 60.0, 90.0}) {
      const Camera camera = view(alpha, beta, options);
      EXPECT_LT((project(camera, isocentre_mm) - Vector2d(511.5, 383.5)).norm(), 1e-9);
      // Isocentric: t is constant once the isocentre is the origin.
      EXPECT_TRUE((camera.camera_from_world * isocentre_mm).isApprox(Vector3d(0, 0, 600), 1e-12));
    }
}

TEST(CarmCamera, MagnificationIsDetectorDistanceOverIsocentreDistance) {
  const Camera camera = view(0, 0);
  const double shift_px = (project(camera, {0, 0, -9}) - project(camera, Vector3d::Zero())).y();
  EXPECT_NEAR(shift_px * 0.586 / 9, 1000.0 / 600.0, 1e-12);
  EXPECT_NEAR(pixel_size_at_mm(camera, Vector3d::Zero()), 0.586 * 0.6, 1e-12);
  EXPECT_TRUE(source_position_mm(camera).isApprox(Vector3d(0, 600, 0)));
}

// Eq 4, corrected: dR = R_0^T R_b2 R_a2 (R_b1 R_a1)^T R_0, which is the identity for equal poses and W_2^T W_1.
TEST(CarmCamera, RelativeMotionBetweenTwoPoses) {
  const auto relative = [](double alpha_1, double beta_1, double alpha_2, double beta_2) {
    const Camera first = view(alpha_1, beta_1), second = view(alpha_2, beta_2);
    return second.camera_from_world * inverse(first.camera_from_world);
  };
  EXPECT_TRUE(relative(17, -33, 17, -33).rotation.isIdentity(1e-12));
  EXPECT_LT(relative(17, -33, 17, -33).translation_mm.norm(), 1e-9);

  const Matrix3d w_1 = world_from_camera_rotation(radians(10), radians(20));
  const Matrix3d w_2 = world_from_camera_rotation(radians(-5), radians(110));
  const RigidTransform motion = relative(10, 20, -5, 110);
  EXPECT_TRUE(motion.rotation.isApprox(w_2.transpose() * w_1, 1e-12));
  const Vector3d c_1 = -600 * w_1.col(2), c_2 = -600 * w_2.col(2);
  EXPECT_TRUE(motion.translation_mm.isApprox(w_2.transpose() * (c_1 - c_2), 1e-12));
  EXPECT_NEAR(
      degrees(geodesic_angle_rad(view(0, 0).camera_from_world.rotation, view(0, 90).camera_from_world.rotation)), 90,
      1e-9);
}

TEST(CarmCamera, DeclaresTwoNamedViewsWithAnglesAndTheDetectorBehindTheIsocentre) {
  const auto cameras = shipped::call("camera.carm", {}).at("camera").as_list<Camera>();
  EXPECT_EQ(cameras.names(), (std::vector<std::string>{"frontal", "lateral"}));
  EXPECT_EQ(cameras[0].width_px, 512);
  EXPECT_TRUE(shipped::declares("camera.carm", at_least_one({"names"})));
  EXPECT_TRUE(shipped::declares("camera.carm", distinct("names")));
  EXPECT_TRUE(shipped::declares("camera.carm", same_length({"names", "alpha_deg", "beta_deg"})));
  EXPECT_TRUE(shipped::declares("camera.carm", below("source_to_isocentre_mm", "source_to_detector_mm")));
}

TEST(PinholeCamera, ProjectsByEquations1To3) {
  const auto outputs = shipped::call("camera.pinhole", {},
                                     {{"width_px", std::int64_t{640}},
                                      {"height_px", std::int64_t{480}},
                                      {"intrinsics", Numbers{1000, 0, 320, 0, 500, 240, 0, 0, 1}},
                                      {"rotation", Numbers{0, -1, 0, 1, 0, 0, 0, 0, 1}},
                                      {"translation_mm", Numbers{1, 2, 100}}});
  const auto& camera = outputs.at("camera").as<Camera>();
  // x_camera = (-y + 1, x + 2, z + 100) = (-19, 12, 130)
  const Vector2d pixel = project(camera, {10, 20, 30});
  EXPECT_NEAR(pixel.x(), 1000 * -19 / 130.0 + 320, 1e-10);
  EXPECT_NEAR(pixel.y(), 500 * 12 / 130.0 + 240, 1e-10);
}

std::string message(const std::string& option, const Numbers& values) {
  return shipped::refusal("camera.pinhole", {}, {{option, values}});
}

TEST(PinholeCamera, DiagnosesWrongMatrices) {
  EXPECT_HAS(message("rotation", {1, 0, 0, 0, 1, 0, 0, 0, -1}), "not a rotation");
  EXPECT_EQ(message("intrinsics", {1706.5, 0, 255.5, 0, 1706.5, 255.5, 0, 0, 2}),
            "camera.pinhole: the camera matrix is not [f_u s u_0; 0 f_v v_0; 0 0 1], row by row");
  EXPECT_HAS(message("intrinsics", {-5, 0, 255.5, 0, 1706.5, 255.5, 0, 0, 1}), "positive focal lengths");
}

std::string said_of(double deviation_u_px, double deviation_v_px) {
  Calibration calibration;
  calibration.intrinsics.diagonal() << 800, 1000, 1;
  calibration.focal_deviation_px = {deviation_u_px, deviation_v_px};
  try {
    return calibration::doubtful_focal_length(calibration, "the images");
  } catch (const Error& error) {
    return std::string("refused: ") + error.what();
  }
}

TEST(FocalLength, IsDoubtfulAboveAHundredthOfItselfAndRefusedAboveATenth) {
  const std::string remedy = "; take the board tilted by 20 degrees or more, to another side in each";
  EXPECT_EQ(said_of(8, 10), "");
  EXPECT_EQ(said_of(9, 10),
            "the images hardly tell the focal length: it is 800 px, known to 9 px (one standard deviation)" + remedy);
  EXPECT_EQ(said_of(8, 101),
            "refused: the images hardly tell the focal length: it is 1000 px, known to 101 px (one standard "
            "deviation)" +
                remedy);
  EXPECT_TRUE(said_of(std::nan(""), 1).starts_with("refused: ")) << "nothing determines it";
}

}  // namespace points_test
