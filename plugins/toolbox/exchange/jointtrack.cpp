// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/exchange/jointtrack.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <sstream>

#include "marrow/base/error.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/base/plain_text.hpp"
#include "marrow/base/printable.hpp"
#include "marrow/toolbox/files/input_file.hpp"
#include "marrow/toolbox/files/yaml_text.hpp"

namespace marrow::exchange {
namespace {

constexpr std::uint64_t kMostBytesOfPoses = 65536;
constexpr const char* kExpected =
    "the distance of the detector from the source, the principal point's x and y from the image's middle, and the side "
    "of a pixel, all in mm";

/// Words between blanks, tabs, commas and ends of lines, as JointTrack takes them.
std::vector<std::string> words_of(std::string text) {
  for (char& c : text)
    if (c == ',' || c == '\r') c = ' ';
  std::istringstream stream(text);
  std::vector<std::string> words;
  for (std::string word; stream >> word;) words.push_back(word);
  return words;
}

constexpr std::uint64_t kMostPoseBytes = 64u << 20;
constexpr double kFarthestOfPoses_mm = 1e6;
using Row = std::array<double, 6>;

/// Turns what is on the camera's side from JointTrack's axes to OpenCV's, and back.
const Eigen::DiagonalMatrix<double, 3> kTurned(1, -1, -1);

Row row_of(const std::vector<std::string>& words, const std::string& place) {
  if (words.size() != 6)
    throw Error(formatted("{}: expected 6 numbers (x, y, z in mm; rotations about z, x, y), got {}", place,
                          counted(words.size(), "word")));
  Row row;
  for (std::size_t i = 0; i < row.size(); ++i) {
    const auto value = parsed_number(words[i]);
    if (!value || !(std::abs(*value) <= kFarthestOfPoses_mm))
      throw Error(formatted("{}: expected numbers of at most 1e6, got {}", place,
                            in_quotes(printable(words[i].substr(0, 40)))));
    row[i] = *value;
  }
  return row;
}

Eigen::Matrix3d about(double angle_rad, int axis) {
  return Eigen::AngleAxisd(angle_rad, Eigen::Vector3d::Unit(axis)).toRotationMatrix();
}

RigidTransform pose_of(const Row& row, const std::array<double, 3>& unit_rad, bool y_down) {
  RigidTransform pose{"camera", "ct"};
  pose.rotation = about(row[3] * unit_rad[0], 2) * about(row[4] * unit_rad[1], 0) * about(row[5] * unit_rad[2], 1);
  if (!y_down) pose.rotation = kTurned * pose.rotation;
  pose.translation_mm = kTurned * Eigen::Vector3d(row[0], row[1], row[2]);
  return pose;
}

/// A column of angles looks like radians if all are within half a turn in radians, and like degrees if one is beyond a
/// whole turn in radians. An implant that is hardly turned about an axis has small degrees, so this is a doubt only.
std::string doubt_about(const std::vector<Row>& rows, std::size_t column, bool in_radians) {
  double largest = 0;
  for (const Row& row : rows) largest = std::max(largest, std::abs(row[3 + column]));
  const std::string name = kJointTrackRotations[column];
  if (in_radians && largest > 2 * kPi)
    return formatted("{} was taken in radians, but reaches {:.3g}: these look like degrees; leave it out of 'radians'",
                     name, largest);
  if (!in_radians && largest > 0.01 && largest <= kPi)
    return formatted(
        "{} was taken in degrees, but is never more than {:.3g}: either the implant is hardly turned about this axis, "
        "or these are radians; then give radians=[{}]",
        name, largest, name);
  return {};
}

}  // namespace

bool is_jointtrack_camera(const std::filesystem::path& path) {
  std::error_code failure;
  if (!std::filesystem::is_regular_file(path, failure)) return false;
  const files::InputFile file(path, true);
  const std::string begin = plain_text(file.text(0, std::size_t(std::min<std::uint64_t>(file.size(), 256))));
  const std::vector<std::string> words = words_of(begin);
  return !words.empty() && (words[0].starts_with("JT_INTCALIB") || words[0].starts_with("JTA_INTCALIB"));
}

Camera read_jointtrack_camera(const std::filesystem::path& path, const ImageSize& size) {
  const std::string what = path.string();
  const std::vector<std::string> words = words_of(files::read_text(path, kMostBytesOfPoses));
  if (words.empty() || (words[0] != "JT_INTCALIB" && words[0] != "JTA_INTCALIB"))
    throw Error(what + ":1: expected JT_INTCALIB, got " + in_quotes(printable(words.empty() ? "" : words[0])) +
                "; a biplane calibration of JointTrack is read from its two camera files, one for each view");
  if (words.size() != 5)
    throw Error(formatted("{}: expected 4 numbers after {} ({}), got {}", what, words[0], kExpected, words.size() - 1));
  std::array<double, 4> numbers;
  for (std::size_t i = 0; i < 4; ++i) {
    const auto value = parsed_number(words[i + 1]);
    if (!value || !std::isfinite(*value))
      throw Error(formatted("{}: expected 4 numbers ({}), got {}", what, kExpected,
                            in_quotes(printable(words[i + 1].substr(0, 40)))));
    numbers[i] = *value;
  }
  const auto [distance_mm, x_mm, y_mm, pixel_mm] = numbers;
  if (!(distance_mm > 0) || !(pixel_mm > 0))
    throw Error(formatted("{}: the distance of the detector and the side of a pixel must be above 0, got {:g} and {:g}",
                          what, distance_mm, pixel_mm));
  const Eigen::Vector2i pixels = size_px(size, what);
  Camera camera;
  camera.width_px = pixels.x(), camera.height_px = pixels.y();
  camera.intrinsics << distance_mm / pixel_mm, 0, 0.5 * (pixels.x() - 1) + x_mm / pixel_mm,  //
      0, distance_mm / pixel_mm, 0.5 * (pixels.y() - 1) - y_mm / pixel_mm,                   //
      0, 0, 1;
  check_camera(camera, what);
  return camera;
}

std::string jointtrack_camera(const Camera& camera, double pixel_mm) {
  const Eigen::Matrix3d& k = camera.intrinsics;
  if (std::abs(k(0, 0) - k(1, 1)) > 1e-4 * k(0, 0) || std::abs(k(0, 1)) > 1e-4 * k(0, 0))
    throw Error(
        formatted("JointTrack's calibration is for square pixels, but this camera has focal lengths of {:g} and {:g} "
                  "pixels and a skew of {:g}",
                  k(0, 0), k(1, 1), k(0, 1)));
  const double x_mm = (k(0, 2) - 0.5 * (camera.width_px - 1)) * pixel_mm,
               y_mm = (0.5 * (camera.height_px - 1) - k(1, 2)) * pixel_mm;
  std::string text = "JT_INTCALIB\n";
  for (const double value : {k(0, 0) * pixel_mm, x_mm, y_mm, pixel_mm}) text += files::number(value) + "\n";
  return text;
}

JointTrackPoses read_jointtrack_poses(const std::filesystem::path& path, const JointTrackConvention& convention) {
  std::istringstream lines(files::read_text(path, kMostPoseBytes));
  std::string line;
  std::getline(lines, line);
  const std::vector<std::string> header = words_of(line);
  if (header.size() != 1 || (header[0] != "JT_EULER_312" && header[0] != "JTA_EULER_KINEMATICS"))
    throw Error(path.string() + ":1: expected JT_EULER_312 or JTA_EULER_KINEMATICS, got " +
                in_quotes(printable(line.substr(0, 60))) + "; save the kinematics as .jts or .jtak in JointTrack");
  std::array<double, 3> unit_rad;
  for (std::size_t i = 0; i < 3; ++i)
    unit_rad[i] =
        std::count(convention.radians.begin(), convention.radians.end(), kJointTrackRotations[i]) ? 1 : kPi / 180;
  JointTrackPoses poses;
  std::vector<Row> rows;
  for (std::size_t number = 2; std::getline(lines, line); ++number) {
    const std::vector<std::string> words = words_of(line);
    if (number == 2 || words.empty()) continue;  // the names of the columns
    if (words[0] == "NOT_OPTIMIZED") {
      poses.camera_from_model.emplace_back();
      continue;
    }
    rows.push_back(row_of(words, formatted("{}:{}", path.string(), number)));
    poses.camera_from_model.push_back(pose_of(rows.back(), unit_rad, convention.y_down));
  }
  if (rows.empty()) throw Error(path.string() + ": there is no pose in it; each frame has a line of 6 numbers");
  for (std::size_t i = 0; i < 3; ++i)
    if (const std::string doubt = doubt_about(rows, i, unit_rad[i] == 1); !doubt.empty())
      poses.doubts.push_back(path.string() + ": " + doubt);
  return poses;
}

std::string jointtrack_poses(const std::vector<std::optional<RigidTransform>>& camera_from_model,
                             const std::string& header) {
  std::string text = header + "\n x_tran, y_tran, z_tran, z_rot, x_rot, y_rot\n";
  for (const auto& pose : camera_from_model) {
    if (!pose) {
      text += "NOT_OPTIMIZED, 0, 0, 0, 0, 0\n";
      continue;
    }
    const Eigen::Matrix3d r = kTurned * pose->rotation;
    const Eigen::Vector3d t = kTurned * pose->translation_mm;
    // R = Rz Rx Ry: its last row is (-cos x sin y, sin x, cos x cos y), its middle column (-sin z cos x, cos z cos x,
    // .).
    const double x = std::asin(std::clamp(r(2, 1), -1.0, 1.0));
    const bool is_locked = std::abs(r(2, 1)) > 1 - 1e-12;  // only z + y or z - y is known: y is taken as 0
    const double z = is_locked ? std::atan2(r(1, 0), r(0, 0)) : std::atan2(-r(0, 1), r(1, 1)),
                 y = is_locked ? 0 : std::atan2(-r(2, 0), r(2, 2));
    text += formatted("{:.10g}, {:.10g}, {:.10g}, {:.10g}, {:.10g}, {:.10g}\n", t.x(), t.y(), t.z(), degrees(z),
                      degrees(x), degrees(y));
  }
  return text;
}

}  // namespace marrow::exchange
