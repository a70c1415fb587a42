// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/files/camera_file.hpp"

#include <charconv>
#include <cmath>
#include <sstream>

#include "marrow/base/error.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/base/plain_text.hpp"
#include "marrow/domain/decompositions.hpp"
#include "marrow/toolbox/distortion/straighten.hpp"
#include "marrow/toolbox/files/input_file.hpp"
#include "marrow/toolbox/files/yaml_values.hpp"

namespace marrow::files {
namespace {

/// Reads XMALab's text line by line.
class XmalabText {
 public:
  explicit XmalabText(const std::filesystem::path& path) : path_(path) {
    const InputFile file(path, true);
    if (file.size() > 65536)
      throw Error(path.string() +
                  ": expected a camera file: marrow's YAML (.yaml) or XMALab's text (image size, camera "
                  "matrix, rotation, translation)");
    stream_.str(plain_text(file.text(0, std::size_t(file.size()))));
  }

  /// Skips empty lines and expects a line with just this title.
  void title(const std::string& expected) {
    std::string line = next_line();
    while (line.empty() && stream_) line = next_line();
    if (line != expected) fail("expected '" + expected + "', got '" + line.substr(0, 40) + "'");
  }

  /// Expects that only empty lines are left, so that no further block is ignored silently.
  void end() {
    while (stream_)
      if (const std::string line = next_line(); !line.empty())
        fail("expected the end of the file after the translation, got '" + line.substr(0, 40) + "', which is not read" +
             (line.rfind("undistortion", 0) == 0 ? ": give images that are already undistorted, and take the block out"
                                                 : ""));
  }

  std::vector<double> numbers(std::size_t count) {
    const std::string line = next_line();
    std::vector<double> values;
    const char *at = line.data(), *end = line.data() + line.size();
    while (at != end) {
      while (at != end && (*at == ' ' || *at == ',' || *at == '\t')) ++at;
      if (at == end) break;
      double value = 0;
      const auto [stop, failure] = std::from_chars(at, end, value);
      if (failure != std::errc() || !std::isfinite(value)) break;
      values.push_back(value);
      at = stop;
    }
    if (values.size() != count || at != end)
      fail(formatted("expected {} numbers, got '{}'", count, line.substr(0, 60)));
    return values;
  }

  [[noreturn]] void fail(const std::string& text) const {
    throw Error(formatted("{}:{}: {}; an XMALab camera has the blocks image size, camera matrix, rotation, translation",
                          path_.string(), line_number_, text));
  }

 private:
  std::string next_line() {
    std::string line;
    std::getline(stream_, line);
    ++line_number_;
    while (!line.empty() && line.back() == ' ') line.pop_back();
    return line;
  }

  std::filesystem::path path_;
  std::istringstream stream_;
  int line_number_ = 0;
};

Eigen::Matrix3d read_matrix(XmalabText& text) {
  Eigen::Matrix3d matrix;
  for (int r = 0; r < 3; ++r) {
    const std::vector<double> row = text.numbers(3);
    matrix.row(r) = Eigen::RowVector3d(row[0], row[1], row[2]);
  }
  return matrix;
}

Camera read_xmalab(const std::filesystem::path& path) {
  XmalabText text(path);
  Camera camera;
  text.title("image size");
  const std::vector<double> size = text.numbers(2);  // width, height, as XMALab writes them
  if (size[0] < 1 || size[1] < 1 || size[0] > 65536 || size[1] > 65536) text.fail("the image size is out of range");
  camera.width_px = int(size[0]);
  camera.height_px = int(size[1]);
  text.title("camera matrix");
  camera.intrinsics = read_matrix(text);
  text.title("rotation");
  const Eigen::Matrix3d rotation = read_matrix(text);
  // The file has 12 digits only. The nearest exact rotation is taken.
  const Eigen::Matrix3d nearest = nearest_orthogonal(rotation);
  if ((nearest - rotation).cwiseAbs().maxCoeff() > 1e-4 || nearest.determinant() < 0)
    text.fail("the matrix under 'rotation' is not a rotation");
  camera.camera_from_world.rotation = nearest;
  text.title("translation");
  for (int i = 0; i < 3; ++i) camera.camera_from_world.translation_mm[i] = text.numbers(1)[0];
  text.end();
  check_camera(camera, path.string());
  return camera;
}

}  // namespace

void straighten(View& view, const CameraInFile& camera) {
  if (!camera.measured.is_none())
    distortion::straighten(view, camera.measured);
  else if (!camera.distortion.is_none())
    remove_distortion(view, camera.distortion);
}

cv::Mat1b straightened_mask(const cv::Mat1b& original, const CameraInFile& camera) {
  return camera.measured.is_none() ? marrow::straightened_mask(original, camera.camera.intrinsics, camera.distortion)
                                   : distortion::straightened_mask(original, camera.measured);
}

cv::Mat1b original_mask(const cv::Mat1b& straight, const CameraInFile& camera) {
  return camera.measured.is_none() ? marrow::original_mask(straight, camera.camera.intrinsics, camera.distortion)
                                   : distortion::original_mask(straight, camera.measured);
}

CameraInFile read_camera_file(const std::filesystem::path& path) {
  if (path.extension() != ".yaml" && path.extension() != ".yml") return {{read_xmalab(path), {}}, {}};
  YamlFile file(path);
  const auto camera = camera_from(file.root(), file);
  if (!file.root()["marrow-camera"]) file.fault(file.root().Mark(), "camera: key 'marrow-camera' is missing");
  file.finish();
  return *camera;
}

}  // namespace marrow::files
