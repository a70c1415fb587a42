// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/exchange/plastimatch_camera.hpp"

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
using Matrix34 = Eigen::Matrix<double, 3, 4>;

/// The finite numbers of a line; nothing if a word is no number.
std::vector<double> numbers_in(const std::string& line) {
  std::istringstream words(line);
  std::vector<double> numbers;
  for (std::string word; words >> word;) {
    const auto value = parsed_number(word);
    if (!value || !std::isfinite(*value)) return {};
    numbers.push_back(*value);
  }
  return numbers;
}

/// Reads the file line by line.
class Text {
 public:
  explicit Text(const std::filesystem::path& path) : path_(path), stream_(files::read_text(path, kMostBytes)) {}

  template <int Rows, int Columns>
  Eigen::Matrix<double, Rows, Columns> numbers(const std::string& what) {
    Eigen::Matrix<double, Rows, Columns> matrix;
    for (int r = 0; r < Rows; ++r) {
      const std::string line = next();
      const std::vector<double> row = numbers_in(line);
      if (row.size() != std::size_t(Columns))
        fail(formatted("expected {}, {}, got {}", what, counted(Columns, "number"),
                       in_quotes(printable(line.substr(0, 60)))));
      for (int c = 0; c < Columns; ++c) matrix(r, c) = row[std::size_t(c)];
    }
    return matrix;
  }
  void title(const std::string& expected) {
    if (const std::string line = next(); line != expected)
      fail("expected '" + expected + "', got " + in_quotes(printable(line.substr(0, 60))) +
           "; plastimatch drr writes this file whole");
  }
  [[noreturn]] void fail(const std::string& text) const {
    throw Error(formatted("{}:{}: {}", path_.string(), line_, text));
  }

 private:
  std::string next() {
    std::string line;
    std::getline(stream_, line);
    ++line_;
    while (!line.empty() && line.back() == ' ') line.pop_back();
    return line;
  }
  std::filesystem::path path_;
  std::istringstream stream_;
  int line_ = 0;
};

}  // namespace

bool is_plastimatch_camera(const std::filesystem::path& path) {
  std::error_code failure;
  if (!std::filesystem::is_regular_file(path, failure)) return false;
  const files::InputFile file(path, true);
  const std::string begin = plain_text(file.text(0, std::size_t(std::min<std::uint64_t>(file.size(), 256))));
  return numbers_in(begin.substr(0, begin.find('\n'))).size() == 2;
}

Camera read_plastimatch_camera(const std::filesystem::path& path, const ImageSize& size) {
  const std::string what = path.string();
  Text text(path);
  const Eigen::Vector2d centre_px = text.numbers<1, 2>("the image centre (column, row)").transpose();
  const Matrix34 matrix = text.numbers<3, 4>("a row of the projection matrix");
  text.numbers<1, 1>("the distance of the isocentre from the source");
  text.numbers<1, 1>("the distance of the detector from the source");
  text.numbers<1, 3>("the direction of the central ray");
  text.title("Extrinsic");
  const Eigen::Matrix4d extrinsic = text.numbers<4, 4>("a row of the extrinsic matrix");
  text.title("Intrinsic");
  const Matrix34 intrinsic = text.numbers<3, 4>("a row of the intrinsic matrix");
  const Eigen::Matrix3d k = intrinsic.leftCols<3>();
  const auto rotation = rotation_near(extrinsic.topLeftCorner<3, 3>());
  const Matrix34 product = intrinsic * extrinsic;
  for (int r = 0; r < 3; ++r)  // the file has 9 digits
    if (!((product.row(r) - matrix.row(r)).norm() <= 1e-5 * matrix.row(r).norm()))
      throw Error(formatted(
          "{}: row {} of its matrix is not that of Intrinsic times Extrinsic; one of them was changed: write it again",
          what, r + 1));
  if (!rotation)
    throw Error(what + ": its extrinsic matrix is no rotation and translation; it is damaged: write it again");
  if (!(k(2, 2) > 0) || !(k(0, 0) > 0) || !(k(1, 1) > 0) || k(1, 0) != 0 || k(2, 0) != 0 || k(2, 1) != 0)
    throw Error(what +
                ": its intrinsic matrix is not that of a camera that looks from the source: expected "
                "1/pixel, 1/pixel, 1/distance on its diagonal");
  const Eigen::Vector2i pixels = size_px(size, what);
  Camera camera;
  camera.width_px = pixels.x();
  camera.height_px = pixels.y();
  camera.intrinsics = k / k(2, 2);
  camera.intrinsics.block<2, 1>(0, 2) += centre_px;
  camera.camera_from_world.rotation = *rotation;
  camera.camera_from_world.translation_mm = extrinsic.topRightCorner<3, 1>();
  check_camera(camera, what);
  return camera;
}

std::string plastimatch_camera(const Camera& camera, const Eigen::Vector2d& pixel_mm) {
  const Eigen::Matrix3d& k = camera.intrinsics;
  const double source_to_detector_mm = 0.5 * (k(0, 0) * pixel_mm.x() + k(1, 1) * pixel_mm.y());
  Eigen::Matrix4d extrinsic = Eigen::Matrix4d::Identity();
  extrinsic.topLeftCorner<3, 3>() = camera.camera_from_world.rotation;
  extrinsic.topRightCorner<3, 1>() = camera.camera_from_world.translation_mm;
  Matrix34 intrinsic = Matrix34::Zero();
  intrinsic.topLeftCorner<2, 2>() = k.topLeftCorner<2, 2>() / source_to_detector_mm;
  intrinsic(2, 2) = 1 / source_to_detector_mm;
  const Matrix34 matrix = intrinsic * extrinsic;
  std::string text;
  const auto put = [&](const auto& rows) {
    for (Eigen::Index r = 0; r < rows.rows(); ++r) {
      for (Eigen::Index c = 0; c < rows.cols(); ++c) text += (c > 0 ? " " : "") + files::number(rows(r, c));
      text += "\n";
    }
  };
  put(Eigen::RowVector2d(k(0, 2), k(1, 2)));
  put(matrix);
  put(Eigen::Matrix<double, 1, 1>(extrinsic(2, 3)));
  put(Eigen::Matrix<double, 1, 1>(source_to_detector_mm));
  put(Eigen::RowVector3d(extrinsic.block<1, 3>(2, 0)));
  text += "Extrinsic\n";
  put(extrinsic);
  text += "Intrinsic\n";
  put(intrinsic);
  return text;
}

}  // namespace marrow::exchange
