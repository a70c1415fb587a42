// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/exchange/maya_camera.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <sstream>
#include <vector>

#include "marrow/base/error.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/base/plain_text.hpp"
#include "marrow/base/printable.hpp"
#include "marrow/toolbox/files/header_lines.hpp"
#include "marrow/toolbox/files/input_file.hpp"

namespace marrow::exchange {
namespace {

constexpr std::uint64_t kMostBytes = 65536;
constexpr double kUsualSize_px = 1024;

/// The finite numbers between the commas of a line; nothing if a part is no number.
std::vector<double> numbers_in(const std::string& line) {
  std::istringstream parts(line);
  std::vector<double> numbers;
  for (std::string part; std::getline(parts, part, ',');) {
    const std::optional<double> number = files::number_of(files::trimmed(part));
    if (!number) return {};
    numbers.push_back(*number);
  }
  return numbers;
}

Eigen::Matrix<double, 5, 3> read_lines(const std::filesystem::path& path) {
  static const char* const kWhat[] = {"the source's place", "the turns about x, y and z in degrees",
                                      "the middle of the film", "the principal point and minus the focal length",
                                      "scale, width and height"};
  std::istringstream stream(files::read_text(path, kMostBytes));
  Eigen::Matrix<double, 5, 3> lines;
  std::string line;
  for (int i = 0; i < 5; ++i) {
    line.clear();
    std::getline(stream, line);
    const std::vector<double> numbers = numbers_in(line);
    if (numbers.size() != 3)
      throw Error(
          formatted("{}:{}: expected {}, 3 numbers with commas between them, got {}; a MayaCam has 5 such lines",
                    path.string(), i + 1, kWhat[i], in_quotes(printable(line.substr(0, 60)))));
    lines.row(i) = Eigen::Map<const Eigen::RowVector3d>(numbers.data());
  }
  for (int number = 6; std::getline(stream, line); ++number)
    if (!files::trimmed(line).empty())
      throw Error(formatted("{}:{}: expected the end of the file after its 5 lines, got {}", path.string(), number,
                            in_quotes(printable(line.substr(0, 60)))));
  return lines;
}

int side_px(double number, const std::filesystem::path& path) {
  const double side = number == 0 ? kUsualSize_px : number;
  if (!(side >= 1 && side <= 65536 && side == std::floor(side)))
    throw Error(formatted("{}:5: expected the image's width and height in pixels, got {:f}", path.string(), number));
  return int(side);
}

}  // namespace

bool is_maya_camera(const std::filesystem::path& path) {
  std::error_code failure;
  if (!std::filesystem::is_regular_file(path, failure)) return false;
  const files::InputFile file(path, true);
  const std::string begin = plain_text(file.text(0, std::size_t(std::min<std::uint64_t>(file.size(), 256))));
  return numbers_in(begin.substr(0, begin.find('\n'))).size() == 3;
}

Camera read_maya_camera(const std::filesystem::path& path) {
  using Eigen::AngleAxisd, Eigen::Vector3d;
  const Eigen::Matrix<double, 5, 3> lines = read_lines(path);
  const Vector3d source_mm = lines.row(0), turn_rad = lines.row(1) * (M_PI / 180);
  const double focal_px = -lines(3, 2);
  if (!(focal_px > 0))
    throw Error(formatted("{}:4: expected minus the focal length in pixels as its third number, got {:f}",
                          path.string(), lines(3, 2)));
  const Eigen::Matrix3d world_from_local =
      (AngleAxisd(turn_rad.z(), Vector3d::UnitZ()) * AngleAxisd(turn_rad.y(), Vector3d::UnitY()) *
       AngleAxisd(turn_rad.x(), Vector3d::UnitX()))
          .toRotationMatrix();
  Camera camera;
  camera.width_px = side_px(lines(4, 1), path);
  camera.height_px = side_px(lines(4, 2), path);
  const double u0 = lines(3, 0) - 1, v0_from_below = lines(3, 1) - 1;
  camera.intrinsics << focal_px, 0, u0, 0, focal_px, camera.height_px - 1 - v0_from_below, 0, 0, 1;
  // From x right, y up, z towards the source to x right, y down, z to the detector.
  camera.camera_from_world.rotation = Vector3d(1, -1, -1).asDiagonal() * world_from_local.transpose();
  camera.camera_from_world.translation_mm = -(camera.camera_from_world.rotation * source_mm);
  check_camera(camera, path.string());
  return camera;
}

}  // namespace marrow::exchange
