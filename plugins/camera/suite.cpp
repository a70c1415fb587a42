// SPDX-License-Identifier: Apache-2.0
// Checks for nodes of the kind camera. A node may compute cameras from images of a bead board, read them from the
// headers of X-ray files, or compare them with known points. Each check runs only for nodes with its inputs and
// options.
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <marrow/plugin.hpp>
#include <random>

#include "samples.hpp"

namespace marrow::conformance {
namespace {

constexpr int kSize_px = 640;
constexpr double kFocal_px = 2133, kPrincipal_u_px = 323.4, kPrincipal_v_px = 316.1,
                 kPincushion = 3;  // 7 % at the middle of an edge
constexpr double kNoise = 250, kBright = 50000;

/// The exact camera of image `number`, without distortion. The board is tilted towards another side in each of 8
/// images.
Camera device(int number) {
  Camera camera{kSize_px, kSize_px, {}, {"camera", "world"}};
  camera.intrinsics << kFocal_px, 0, kPrincipal_u_px, 0, kFocal_px, kPrincipal_v_px, 0, 0, 1;
  const double towards = 2 * kPi * number / 8 + 0.2;
  camera.camera_from_world.rotation =
      (Eigen::AngleAxisd(radians(9 + number), Eigen::Vector3d(std::cos(towards), std::sin(towards), 0)) *
       Eigen::AngleAxisd(0.3 * number, Eigen::Vector3d::UnitZ()))
          .toRotationMatrix();
  const Eigen::Vector3d middle(0, 0, 40);
  camera.camera_from_world.translation_mm =
      Eigen::Vector3d(2.0 * number - 8, 5.0 - number, 640) - camera.camera_from_world.rotation * middle;
  return camera;
}

/// Pixel of a point in the distorted image.
Eigen::Vector2d seen_px(const Camera& camera, const Eigen::Vector3d& point) {
  const Eigen::Vector2d principal(kPrincipal_u_px, kPrincipal_v_px),
      ideal = (project(camera, point) - principal) / kFocal_px;
  return principal + kFocal_px * (1 + kPincushion * ideal.squaredNorm()) * ideal;
}

/// Dark balls on a constant background, with 3 x 3 samples per pixel and noise.
cv::Mat board_image(int number) {
  const Camera camera = device(number);
  cv::Mat pixels(kSize_px, kSize_px, CV_16U, cv::Scalar(kBright));
  std::mt19937 random(std::uint32_t(number) + 1);
  for (int v = 0; v < kSize_px; ++v)
    for (int u = 0; u < kSize_px; ++u)
      pixels.at<std::uint16_t>(v, u) = std::uint16_t(kBright + kNoise * (double(random()) / 2147483648.0 - 1));
  for (const Bead& bead : board_beads()) {
    const Eigen::Vector2d at = seen_px(camera, bead.centre_mm);
    const double radius = 0.5 * bead.diameter_mm * kFocal_px / (camera.camera_from_world * bead.centre_mm).z();
    for (int v = std::max(0, int(at.y() - radius - 2)); v <= std::min(kSize_px - 1, int(at.y() + radius + 2)); ++v)
      for (int u = std::max(0, int(at.x() - radius - 2)); u <= std::min(kSize_px - 1, int(at.x() + radius + 2)); ++u) {
        double through = 0;
        for (int i = 0; i < 9; ++i) {
          const double off = (Eigen::Vector2d(u + (i % 3 - 1) / 3.0, v + (i / 3 - 1) / 3.0) - at).norm() / radius;
          through += (1 - 0.6 * std::sqrt(std::max(0.0, 1 - off * off))) / 9;
        }
        pixels.at<std::uint16_t>(v, u) = std::uint16_t(pixels.at<std::uint16_t>(v, u) * through);
      }
  }
  return pixels;
}

Value images_of(const std::vector<cv::Mat>& pixels) {
  List<Image> list;
  for (std::size_t i = 0; i < pixels.size(); ++i) list.add(formatted("{}", i + 1), Image{pixels[i]});
  return Value::of<Image>(list, "view");
}

std::vector<cv::Mat> board_images() {
  static const std::vector<cv::Mat> kImages = [] {
    std::vector<cv::Mat> images;
    for (int i = 0; i < 8; ++i) images.push_back(board_image(i));
    return images;
  }();
  return kImages;
}

View view_of(const std::string& name, const Camera& camera) {
  return {name, Image{cv::Mat(camera.height_px, camera.width_px, CV_16U, cv::Scalar(20000))}, camera, {}};
}

Value views_of(const Camera& a, const Camera& b) {
  List<View> list;
  list.add("a", view_of("a", a));
  list.add("b", view_of("b", b));
  return Value::of<View>(list, "view");
}

/// A second view of the board: device(3) turned by 50 degrees about the middle of the board.
Camera second() {
  Camera camera = device(3);
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(radians(50), Eigen::Vector3d::UnitY()).toRotationMatrix();
  const Eigen::Vector3d middle(0, 0, 40), seen = camera.camera_from_world * middle;
  camera.camera_from_world.rotation = camera.camera_from_world.rotation * turn;
  camera.camera_from_world.translation_mm = seen - camera.camera_from_world.rotation * middle;
  return camera;
}

Value chessboards() {
  static const Value kPictures = [] {
    List<Picture> list;
    for (int i = 0; i < 5; ++i)
      list.add(formatted("{}", i), chessboard_picture(device(i), Eigen::Vector3d(2.0 * i, 5.0 - i, 1000)));
    return Value::of<Picture>(list, "photograph");
  }();
  return kPictures;
}

Camera plate_camera() {
  Camera camera = device(0);
  camera.width_px = camera.height_px = plate_distortion().width_px;
  return camera;
}

Inputs sample() {
  List<Picture> photographs;
  List<Camera> cameras;
  for (const char* name : {"a", "b"}) {
    photographs.add(name, {cv::Mat(kSize_px, kSize_px, CV_8UC3, cv::Scalar(80, 120, 40))});
    cameras.add(name, device(0));
  }
  Calibration calibration;
  calibration.width_px = calibration.height_px = kSize_px;
  calibration.intrinsics = device(0).intrinsics;
  calibration.distortion.k = {0.1, 0, 0};
  return {{"images", images_of(board_images())},
          {"views", views_of(device(0), second())},
          {"boards", chessboards()},
          {"photographs", Value::of<Picture>(photographs, "view")},
          {"cameras", Value::of<Camera>(cameras, "view")},
          {"calibration", Value::of<Calibration>(std::make_shared<const Calibration>(calibration))},
          {"image", item(plate_image())},
          {"points", item(plate_points())},
          {"view", item(View{"a", plate_image(), plate_camera(), {}})},
          {"distortion", item(plate_distortion())},
          {"distortions", plate_distortions()}};
}

std::map<std::string, OptionValue> options() {
  return {
      {"board", board_file().string()},
      {"points", points_file(device(0), second(), false).string()},
      {"known_points", points_file(device(0), second(), false).string()},
      {"paths", std::vector<std::string>{xray_file("frontal", 0, 0).string(), xray_file("oblique", -30, 20).string()}},
      {"names", std::vector<std::string>{"frontal", "oblique"}},
      {"measured_at", std::vector<double>{0, 40}},
      {"wanted_at", std::vector<double>{10, 40}}};
}

void validate(const Inputs&, const std::vector<PortInfo>& ports, const std::vector<Value>& outputs) {
  for (std::size_t i = 0; i < ports.size(); ++i) {
    if (outputs[i].is_absent()) continue;
    const std::vector<Value> items = outputs[i].is_list() ? outputs[i].items : std::vector<Value>{outputs[i]};
    for (const Value& one : items) {
      if (ports[i].type == TypeInfo::of<Camera>()) {
        try {
          check_camera(one.as<Camera>(), "the camera");
        } catch (const Error& error) {
          throw Failure(std::string("it gives a camera that is none: ") + error.what());
        }
      }
      if (ports[i].type == TypeInfo::of<Metrics>())
        for (const Metric& metric : one.as<Metrics>().items)
          expect(!std::isnan(metric.value), "its figure " + metric.name + " is not a number");
    }
  }
}

bool has_input(const Subject& subject, const std::string& name) {
  const auto& ports = subject.info().inputs;
  return std::any_of(ports.begin(), ports.end(), [&](const PortInfo& port) { return port.name == name; });
}

bool has_option(const Subject& subject, const std::string& name) {
  const auto& options = subject.info().options;
  return std::any_of(options.begin(), options.end(), [&](const OptionInfo& option) { return option.name == name; });
}

List<Camera> cameras_of(const Subject& subject, const char* input_or_option) {
  if (!has_input(subject, input_or_option) && !has_option(subject, input_or_option))
    throw NotApplicable(std::string("it has no ") + (input_or_option == std::string("images") ? "input" : "option") +
                        " '" + input_or_option + "'");
  return subject.output(sample(), "camera").as_list<Camera>();
}

double focal_length(const Subject& subject) {
  double worst = 0;
  for (const Camera& camera : cameras_of(subject, "images"))
    worst = std::max(
        {worst, std::abs(camera.intrinsics(0, 0) / kFocal_px - 1), std::abs(camera.intrinsics(1, 1) / kFocal_px - 1)});
  return 100 * worst;
}

double principal_point(const Subject& subject) {
  double worst = 0;
  for (const Camera& camera : cameras_of(subject, "images"))
    worst = std::max(worst,
                     (camera.intrinsics.col(2).head<2>() - Eigen::Vector2d(kPrincipal_u_px, kPrincipal_v_px)).norm());
  return worst;
}

double board_error(const Subject& subject) {
  const List<Camera> cameras = cameras_of(subject, "images");
  expect(cameras.size() == 8, formatted("it gives {} cameras for 8 images", cameras.size()));
  double sum = 0;
  for (std::size_t i = 0; i < 8; ++i)
    for (const Bead& bead : board_beads())
      sum += (project(cameras[i], bead.centre_mm) - project(device(int(i)), bead.centre_mm)).squaredNorm();
  return std::sqrt(sum / double(8 * board_beads().size()));
}

/// In the DICOM standard's axes (left, back, head), the direction from the isocentre to the detector is (sin p cos s,
/// -cos p cos s, sin s), with the primary angle p and the secondary angle s.
double arm_direction(const Subject& subject) {
  const List<Camera> cameras = cameras_of(subject, "paths");
  expect(cameras.size() == 2, formatted("it gives {} cameras for 2 files", cameras.size()));
  double worst = 0;
  for (const auto& [number, p, s] :
       {std::tuple<std::size_t, double, double>{0, 0, 0}, {1, radians(-30), radians(20)}}) {
    const Eigen::Vector3d detector(std::sin(p) * std::cos(s), -std::cos(p) * std::cos(s), std::sin(s));
    worst = std::max(worst, (source_position_mm(cameras[number]) + 600 * detector).norm());
    worst = std::max(worst, 600 * (cameras[number].camera_from_world.rotation.row(2).transpose() - detector).norm());
  }
  return worst;
}

double arm_pixels(const Subject& subject) {
  double worst = 0;
  for (const Camera& camera : cameras_of(subject, "paths"))
    worst = std::max({worst, std::abs(camera.intrinsics(0, 0) - 2500), std::abs(camera.intrinsics(1, 1) - 1000 / 0.3),
                      std::abs(camera.intrinsics(0, 2) - 31.5), std::abs(camera.intrinsics(1, 2) - 23.5)});
  return worst;
}

/// The number of warnings about two views; a refusal counts as one.
double warnings(const Subject& subject, const Camera& a, const Camera& b) {
  const Result result = subject.call({{"views", views_of(a, b)}});
  if (result.refusal) return 1;
  for (const Value& output : result.outputs)
    if (output.type == TypeInfo::of<Metrics>())
      for (const Metric& metric : output.as<Metrics>().items)
        if (metric.name == "warnings") return metric.value;
  throw NotApplicable("it has no figure 'warnings'");
}

double right_cameras(const Subject& subject) { return warnings(subject, device(0), second()); }

/// The check gives 1 if there is no warning about a wrong camera.
Check wrong_camera(const std::string& name, const std::string& what,
                   const std::function<double(const Subject&)>& warnings_of) {
  return {{name, what + ": wrong cameras without a warning", 0, "views"}, [warnings_of](const Subject& subject) {
            if (!has_option(subject, "points")) throw NotApplicable("it has no option 'points'");
            return warnings_of(subject) > 0 ? 0.0 : 1.0;
          }};
}

double plate_error(const Subject& subject) {
  const auto outputs = subject.info().outputs;
  if (std::none_of(outputs.begin(), outputs.end(), [](const PortInfo& port) { return port.name == "distortion"; }) ||
      has_input(subject, "distortions"))
    throw NotApplicable("it does not measure a distortion");
  return plate_distance_px(subject.output(sample(), "distortion").as<distortion::Distortion>());
}

std::vector<Trial> trials() {
  const auto even = [](int count, int width, int height, double value) {
    return [=] {
      return Inputs{{"images", images_of(std::vector<cv::Mat>(std::size_t(count),
                                                              cv::Mat(height, width, CV_16U, cv::Scalar(value))))},
                    {"views", views_of(device(0), second())}};
    };
  };
  const auto with_image = [](cv::Mat (*change)(cv::Mat)) {
    return [change] {
      std::vector<cv::Mat> images = board_images();
      images[2] = change(images[2].clone());
      return Inputs{{"images", images_of(images)}, {"views", views_of(device(0), second())}};
    };
  };
  const auto with_camera = [](void (*change)(Camera&)) {
    return [change] {
      Camera camera = device(0);
      change(camera);
      return Inputs{{"images", images_of(board_images())}, {"views", views_of(camera, second())}};
    };
  };
  return {
      {"no_image", even(0, 0, 0, 0)},
      {"two_images",
       [] {
         return Inputs{{"images", images_of({board_image(0), board_image(1)})},
                       {"views", views_of(device(0), second())}};
       }},
      {"empty_images", even(8, 0, 0, 0)},
      {"one_pixel", even(8, 1, 1, 30000)},
      {"constant_images", even(8, kSize_px, kSize_px, 30000)},
      {"large_images", even(3, 3000, 2000, 30000)},
      {"mixed_sizes", with_image([](cv::Mat image) { return cv::Mat(image(cv::Rect(0, 0, 500, 640))); })},
      {"no_board_in_one", with_image([](cv::Mat image) {
         image.setTo(kBright);
         return image;
       })},
      {"nan_pixels", with_image([](cv::Mat image) {
         cv::Mat pixels;
         image.convertTo(pixels, CV_32F);
         pixels.at<float>(300, 300) = std::nanf("");
         return pixels;
       })},
      {"nan_camera", with_camera([](Camera& camera) { camera.camera_from_world.translation_mm.x() = std::nan(""); })},
      {"plate_without_dots",
       [] {
         return Inputs{{"image", item(Image{cv::Mat(200, 300, CV_16U, cv::Scalar(9))})}};
       }},
      {"plate_of_colours",
       [] {
         return Inputs{{"image", item(Image{cv::Mat(200, 300, CV_8UC3, cv::Scalar(9))})}};
       }},
      {"view_of_another_size",
       [] {
         View view{"a", {cv::Mat(200, 300, CV_16U, cv::Scalar(9))}, plate_camera(), {}};
         view.camera.width_px = 300;
         view.camera.height_px = 200;
         return Inputs{{"view", item(view)}};
       }},
      {"camera_without_focal_length", with_camera([](Camera& camera) { camera.intrinsics(0, 0) = 0; })}};
}

Suite camera_suite() {
  Suite suite{sample, validate, trials(), {}, options};
  const std::string board = "8 images of a bead board with 7 % pincushion distortion: ",
                    arm = "cameras from the headers of two X-ray files: ",
                    check = "points of a board seen in two views, ";
  suite.accuracy.push_back({{"focal_length", board + "largest error of the focal length", 0.15, "%"}, focal_length});
  suite.accuracy.push_back(
      {{"principal_point", board + "largest distance of the principal point from the true one", 0.5, "px"},
       principal_point});
  suite.accuracy.push_back(
      {{"board", board + "root mean square reprojection error of the beads", 0.3, "px"}, board_error});
  suite.accuracy.push_back(
      {{"arm_direction",
        arm + "largest error of the source's position and of the beam's direction, measured at the isocentre", 0.01,
        "mm"},
       arm_direction});
  suite.accuracy.push_back(
      {{"arm_pixels", arm + "largest error of focal length and principal point", 0.01, "px"}, arm_pixels});
  suite.accuracy.push_back(
      {{"right_cameras", check + "cameras are right: number of warnings", 0, "warnings"}, right_cameras});
  suite.accuracy.push_back(
      wrong_camera("mirrored", check + "seen positions mirrored left to right", [](const Subject& subject) {
        return warnings(subject.with("points", points_file(device(0), second(), true).string()), device(0), second());
      }));
  suite.accuracy.push_back(
      {{"plate", "a plate with 6 px of pincushion and 2 px of turn: largest distance from the exact distortion", 0.3,
        "px"},
       plate_error});
  const auto changed = [&](const std::string& name, const std::string& what, void (*change)(Camera&)) {
    suite.accuracy.push_back(wrong_camera(name, check + what, [change](const Subject& subject) {
      Camera camera = device(0);
      change(camera);
      return warnings(subject, camera, second());
    }));
  };
  changed("wrong_unit", "position of one camera in metres",
          [](Camera& camera) { camera.camera_from_world.translation_mm /= 1000; });
  changed("flipped_axis", "v axis of one camera points up", [](Camera& camera) {
    camera.camera_from_world.rotation.bottomRows<2>() *= -1;
    camera.camera_from_world.translation_mm.tail<2>() *= -1;
  });
  changed("other_size", "one camera matrix belongs to an image of twice the size",
          [](Camera& camera) { camera.intrinsics.topRows<2>() *= 2; });
  return suite;
}

}  // namespace
}  // namespace marrow::conformance

MARROW_PLUGIN(plugin) { plugin.suite("camera", marrow::conformance::camera_suite()); }
