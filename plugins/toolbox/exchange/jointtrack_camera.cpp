// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/exchange/jointtrack_camera.hpp"

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

constexpr std::uint64_t kMostBytes = 65536;
constexpr const char* kExpected =
    "the distance of the detector from the source, the principal point's x and y from the image's middle, and the side "
    "of a pixel, all in mm";

/// Words between blanks, commas and ends of lines, as JointTrack takes them.
std::vector<std::string> words_of(std::string text) {
  for (char& c : text)
    if (c == ',' || c == '\r') c = ' ';
  std::istringstream stream(text);
  std::vector<std::string> words;
  for (std::string word; stream >> word;) words.push_back(word);
  return words;
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
  const std::vector<std::string> words = words_of(files::read_text(path, kMostBytes));
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

}  // namespace marrow::exchange
