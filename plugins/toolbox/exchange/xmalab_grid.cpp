// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/exchange/xmalab_grid.hpp"

#include <cmath>
#include <sstream>

#include "marrow/base/number_text.hpp"
#include "marrow/toolbox/files/input_file.hpp"
#include "marrow/toolbox/files/yaml_text.hpp"

namespace marrow::exchange {
namespace {

constexpr std::uint64_t kMostBytesOfGrid = 16u << 20;

/// The numbers of a file's lines; empty lines are left out. Each line must have `count`.
std::vector<std::vector<double>> rows_of(const std::filesystem::path& path, std::size_t count, const char* expected) {
  std::istringstream lines(files::read_text(path, kMostBytesOfGrid));
  std::vector<std::vector<double>> rows;
  std::string line;
  for (std::size_t number = 1; std::getline(lines, line); ++number) {
    std::vector<double> row;
    bool is_right = true;
    for (std::size_t at = 0; at < line.size();) {
      const std::size_t begin = at, end = std::min(line.find_first_of(", \t", at), line.size());
      at = end + 1;
      if (begin == end) continue;
      const auto value = parsed_number(line.substr(begin, end - begin));
      is_right &= value && std::isfinite(*value);
      row.push_back(value.value_or(0));
    }
    if (row.empty() && is_right) continue;
    if (!is_right || row.size() != count)
      throw Error(formatted("{}:{}: expected {}, got '{}'", path.string(), number, expected, line.substr(0, 60)));
    rows.push_back(row);
  }
  if (rows.empty()) throw Error(path.string() + ": there is no number in it");
  return rows;
}

std::string lines_of(const std::vector<Eigen::Vector2d>& places) {
  std::string text;
  for (const Eigen::Vector2d& place : places) text += files::number(place.x()) + ", " + files::number(place.y()) + "\n";
  return text;
}

}  // namespace

distortion::PlatePoints read_xmalab_grid(const XmalabGridFiles& paths, int width_px, int height_px) {
  const char* const place = "two numbers, u and v in pixels";
  const auto seen = rows_of(paths.distorted, 2, place), ideal = rows_of(paths.references, 2, place);
  std::vector<std::vector<double>> inlier(seen.size(), {1});
  if (!paths.inlier.empty()) inlier = rows_of(paths.inlier, 1, "1 or 0");
  if (ideal.size() != seen.size() || inlier.size() != seen.size())
    throw Error(formatted(
        "{} has {} points, {} has {}{}; the files must be of one grid", paths.distorted.string(), seen.size(),
        paths.references.string(), ideal.size(),
        paths.inlier.empty() ? std::string() : formatted(", {} has {}", paths.inlier.string(), inlier.size())));
  distortion::PlatePoints points;
  points.width_px = width_px;
  points.height_px = height_px;
  for (std::size_t i = 0; i < seen.size(); ++i)
    points.add({ideal[i][0], ideal[i][1]}, {seen[i][0], seen[i][1]}, inlier[i][0] > 0.5);
  return points;
}

std::vector<double> read_xmalab_parameters(const std::filesystem::path& path) {
  std::vector<double> parameters;
  for (const auto& row : rows_of(path, 1, "one number")) parameters.push_back(row[0]);
  if (parameters.size() != 8)
    throw Error(formatted("{}: expected the 8 numbers k1, k2, p1, p2, k3, k4, k5, k6, one a line, got {}",
                          path.string(), parameters.size()));
  return parameters;
}

std::string xmalab_distorted(const distortion::PlatePoints& points) { return lines_of(points.seen_px); }
std::string xmalab_references(const distortion::PlatePoints& points) { return lines_of(points.ideal_px); }
std::string xmalab_inlier(const distortion::PlatePoints& points) {
  std::string text;
  for (const std::uint8_t used : points.used) text += used ? "1\n" : "0\n";
  return text;
}

std::string xmalab_camera(const Camera& camera) {
  check_camera(camera, "the camera for XMALab");
  const auto matrix = [](const Eigen::Matrix3d& m) {
    std::string text;
    for (int row = 0; row < 3; ++row)
      text += files::number(m(row, 0)) + "," + files::number(m(row, 1)) + "," + files::number(m(row, 2)) + "\n";
    return text;
  };
  std::string text = formatted("image size\n{},{}\n\ncamera matrix\n", camera.width_px, camera.height_px);
  text += matrix(camera.intrinsics) + "\nrotation\n" + matrix(camera.camera_from_world.rotation) + "\ntranslation\n";
  for (const double value : camera.camera_from_world.translation_mm) text += files::number(value) + "\n";
  return text;
}

}  // namespace marrow::exchange
