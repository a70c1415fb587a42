// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/exchange/cameras.hpp"

#include <algorithm>
#include <cmath>
#include <sstream>

#include "marrow/base/number_text.hpp"
#include "marrow/base/plain_text.hpp"
#include "marrow/base/printable.hpp"
#include "marrow/domain/decompositions.hpp"
#include "marrow/toolbox/files/camera_file.hpp"
#include "marrow/toolbox/files/header_lines.hpp"
#include "marrow/toolbox/files/yaml_text.hpp"

namespace marrow::exchange {
namespace {

constexpr double kLargestSide_px = 65536;

/// Turns pixels of a program's image into those of the image that was turned over.
Eigen::Matrix3d turning(Mirror mirror, int width_px, int height_px) {
  Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();
  if (mirror == Mirror::left_right) turn.row(0) << -1, 0, width_px - 1;
  if (mirror == Mirror::upside_down) turn.row(1) << 0, -1, height_px - 1;
  return turn;
}

constexpr std::uint64_t kMostBytesOfCameras = 65536;
constexpr double kUsualSize_px = 1024;

/// The finite numbers between the commas of a line; nothing if a part is no number.
std::vector<double> numbers_between_commas(const std::string& line) {
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
  std::istringstream stream(files::read_text(path, kMostBytesOfCameras));
  Eigen::Matrix<double, 5, 3> lines;
  std::string line;
  for (int i = 0; i < 5; ++i) {
    line.clear();
    std::getline(stream, line);
    const std::vector<double> numbers = numbers_between_commas(line);
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

using Matrix34 = Eigen::Matrix<double, 3, 4>;

/// The finite numbers of a line; nothing if a word is no number.
std::vector<double> numbers_of_words(const std::string& line) {
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
  explicit Text(const std::filesystem::path& path)
      : path_(path), stream_(files::read_text(path, kMostBytesOfCameras)) {}

  template <int Rows, int Columns>
  Eigen::Matrix<double, Rows, Columns> numbers(const std::string& what) {
    Eigen::Matrix<double, Rows, Columns> matrix;
    for (int r = 0; r < Rows; ++r) {
      const std::string line = next();
      const std::vector<double> row = numbers_of_words(line);
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

Mirror mirror_of(const std::string& text) {
  return text == "left_right" ? Mirror::left_right : text == "upside_down" ? Mirror::upside_down : Mirror::none;
}

Eigen::Vector2d mirrored(const Eigen::Vector2d& pixel, Mirror mirror, int width_px, int height_px) {
  return (turning(mirror, width_px, height_px) * pixel.homogeneous()).head<2>();
}

Eigen::Vector2i size_px(const ImageSize& size, const std::string& what) {
  if (size.size_px.empty())
    throw Error(what +
                ": does not say how many pixels the image has; wire the image, or give image_size_px: [width, height]");
  if (size.size_px.size() != 2)
    throw Error(formatted("{}: image_size_px: expected [width, height], got {} numbers", what, size.size_px.size()));
  for (const double side : size.size_px)
    if (!(side >= 1 && side <= kLargestSide_px) || side != std::floor(side))
      throw Error(formatted("{}: image_size_px: expected 1 to 65536 pixels each way, got {:f}", what, side));
  return {int(size.size_px[0]), int(size.size_px[1])};
}

Eigen::Vector2d pixel_mm(const std::vector<double>& numbers, const std::string& what) {
  if (numbers.empty())
    throw Error(what + ": needs the size of a pixel on the detector; give pixel_mm: [width, height]");
  if (numbers.size() > 2)
    throw Error(formatted("{}: pixel_mm: expected [width, height], or one number for square pixels, got {}", what,
                          numbers.size()));
  for (const double side : numbers)
    if (!(side >= 1e-6 && side <= 1000))
      throw Error(formatted("{}: pixel_mm: expected a size in mm between 1e-6 and 1000, got {:f}", what, side));
  return {numbers.front(), numbers.back()};
}

Eigen::Vector2d corner_mm(const ImageSize& size, const std::string& what) {
  if (size.corner_mm.empty())
    return -0.5 *
           (size_px(size, what).cast<double>() - Eigen::Vector2d::Ones()).cwiseProduct(pixel_mm(size.pixel_mm, what));
  if (size.corner_mm.size() != 2)
    throw Error(formatted(
        "{}: corner_mm: expected [u, v], the place of the first pixel's centre on the detector, got {} numbers", what,
        size.corner_mm.size()));
  return {size.corner_mm[0], size.corner_mm[1]};
}

std::optional<Eigen::Matrix3d> rotation_near(const Eigen::Matrix3d& matrix) {
  const Eigen::Matrix3d nearest = nearest_orthogonal(matrix);
  const double defect = (nearest - matrix).cwiseAbs().maxCoeff();
  if (!(defect < 1e-4) || nearest.determinant() < 0) return std::nullopt;
  return defect < 1e-12 ? matrix : nearest;
}

Camera camera_of(const Eigen::Matrix<double, 3, 4>& pixel_from_world, const Eigen::Vector2i& size_px, Mirror mirror,
                 const std::string& what) {
  const auto found = files::camera_of_projection(turning(mirror, size_px.x(), size_px.y()) * pixel_from_world, size_px);
  if (!found)
    throw Error(what + ": its matrix does not project along rays from a source; it is damaged, or of parallel rays");
  if (found->is_mirrored && mirror == Mirror::none)
    throw Error(what +
                ": its images are seen from the detector, or have their rows from below; turn them over by mirror: "
                "left_right or upside_down when they are read, and give the same mirror here");
  if (found->is_mirrored) throw Error(what + ": its images are seen from the source as marrow's are; leave mirror out");
  check_camera(found->camera, what);
  return found->camera;
}

bool is_maya_camera(const std::filesystem::path& path) {
  std::error_code failure;
  if (!std::filesystem::is_regular_file(path, failure)) return false;
  const files::InputFile file(path, true);
  const std::string begin = plain_text(file.text(0, std::size_t(std::min<std::uint64_t>(file.size(), 256))));
  return numbers_between_commas(begin.substr(0, begin.find('\n'))).size() == 3;
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

bool is_plastimatch_camera(const std::filesystem::path& path) {
  std::error_code failure;
  if (!std::filesystem::is_regular_file(path, failure)) return false;
  const files::InputFile file(path, true);
  const std::string begin = plain_text(file.text(0, std::size_t(std::min<std::uint64_t>(file.size(), 256))));
  return numbers_of_words(begin.substr(0, begin.find('\n'))).size() == 2;
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
