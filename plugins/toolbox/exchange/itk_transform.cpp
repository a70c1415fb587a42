// SPDX-License-Identifier: Apache-2.0
// ITK's text format of transforms: "Transform: TYPE", "Parameters: ..." and "FixedParameters: ...".
#include "marrow/toolbox/exchange/itk_transform.hpp"

#include <cmath>
#include <optional>
#include <sstream>
#include <vector>

#include "marrow/base/error.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/base/printable.hpp"
#include "marrow/toolbox/exchange/cameras.hpp"
#include "marrow/toolbox/files/header_lines.hpp"
#include "marrow/toolbox/files/yaml_text.hpp"

namespace marrow::exchange {
namespace {

constexpr std::uint64_t kMostBytesOfTransform = 65536;  // a rigid transform has 15 numbers
constexpr double kFarthest_mm = 1e6;

/// The three lines of the one transform, with their numbers in the file.
struct Lines {
  std::filesystem::path path;
  std::string type, parameters, fixed;
  std::size_t type_line = 0, parameters_line = 0, fixed_line = 0;

  [[noreturn]] void refuse(std::size_t line, const std::string& what) const {
    throw Error(formatted("{}:{}: {}", path.string(), line, what));
  }
};

/// The value behind "KEY:", or std::nullopt.
std::optional<std::string> value_of(const std::string& text, const std::string& key) {
  if (text.compare(0, key.size(), key) != 0 || text.size() <= key.size() || text[key.size()] != ':')
    return std::nullopt;
  const std::size_t begin = text.find_first_not_of(" \t", key.size() + 1);
  return begin == std::string::npos ? "" : text.substr(begin);
}

Lines lines_of(const std::filesystem::path& path) {
  std::istringstream stream(files::read_text(path, kMostBytesOfTransform));
  Lines lines{path, "", "", ""};
  std::string text;
  for (std::size_t number = 1; std::getline(stream, text); ++number) {
    while (!text.empty() && (text.back() == ' ' || text.back() == '\t')) text.pop_back();
    if (number == 1 && text.rfind("#Insight Transform File V1", 0) != 0)
      lines.refuse(1, "expected '#Insight Transform File V1.0', got " + in_quotes(printable(text.substr(0, 60))) +
                          "; save the transform as .tfm in 3D Slicer or ITK");
    if (text.empty() || text[0] == '#') continue;
    if (const auto type = value_of(text, "Transform")) {
      if (lines.type_line)
        lines.refuse(number,
                     "a second transform begins, but a pose is one; in 3D Slicer, harden the transforms into "
                     "one, and save that");
      lines.type = *type;
      lines.type_line = number;
    } else if (const auto parameters = value_of(text, "Parameters")) {
      lines.parameters = *parameters;
      lines.parameters_line = number;
    } else if (const auto fixed = value_of(text, "FixedParameters")) {
      lines.fixed = *fixed;
      lines.fixed_line = number;
    } else {
      lines.refuse(number, "expected 'Transform:', 'Parameters:' or 'FixedParameters:', got " +
                               in_quotes(printable(text.substr(0, 60))));
    }
  }
  for (const auto& [line, key] : {std::pair(lines.type_line, "Transform"),
                                  {lines.parameters_line, "Parameters"},
                                  {lines.fixed_line, "FixedParameters"}})
    if (!line)
      throw Error(path.string() + ": there is no line '" + key + ":'; the file is cut off, or no transform of ITK");
  return lines;
}

std::vector<double> numbers_of(const Lines& lines, const std::string& text, std::size_t line) {
  std::istringstream words(text);
  std::vector<double> numbers;
  for (std::string word; words >> word;) {
    const auto value = parsed_number(word);
    if (!value || !(std::abs(*value) <= kFarthest_mm))
      lines.refuse(line, "expected numbers of at most 1e6, got " + in_quotes(printable(word.substr(0, 40))));
    numbers.push_back(*value);
  }
  return numbers;
}

void expect_count(const Lines& lines, std::size_t line, std::size_t expected, std::size_t got, const char* what) {
  if (got != expected) lines.refuse(line, formatted("{} has {} {}, got {}", lines.type, expected, what, got));
}

/// The type without the kind of its numbers: "AffineTransform" of "AffineTransform_double_3_3".
std::string class_of(const Lines& lines) {
  for (const char* end : {"_double_3_3", "_float_3_3"}) {
    const std::size_t at = lines.type.find(end);
    if (at != std::string::npos && at + std::string(end).size() == lines.type.size()) return lines.type.substr(0, at);
  }
  return "";
}

/// Versor: the vector part of a unit quaternion whose scalar part is positive.
Eigen::Matrix3d rotation_of_versor(const Lines& lines, const Eigen::Vector3d& versor) {
  const double rest = 1 - versor.squaredNorm();
  if (rest < -1e-6) lines.refuse(lines.parameters_line, "the versor is longer than 1, so it is no rotation");
  return Eigen::Quaterniond(std::sqrt(std::max(0.0, rest)), versor.x(), versor.y(), versor.z())
      .normalized()
      .toRotationMatrix();
}

/// Angles in radians about x, y and z. ITK turns about y first, then x, then z; with `zyx` about x, then y, then z.
Eigen::Matrix3d rotation_of_angles(const Eigen::Vector3d& angles_rad, bool zyx) {
  const auto about = [&](int axis) { return rotation_from_vector(angles_rad[axis] * Eigen::Vector3d::Unit(axis)); };
  return zyx ? about(2) * about(1) * about(0) : about(2) * about(0) * about(1);
}

Eigen::Matrix3d rotation_of(const Lines& lines, const std::vector<double>& p, const std::vector<double>& fixed) {
  const std::string name = class_of(lines);
  if (name == "AffineTransform" || name == "MatrixOffsetTransformBase") {
    expect_count(lines, lines.parameters_line, 12, p.size(), "parameters");
    Eigen::Matrix3d matrix;
    for (int i = 0; i < 9; ++i) matrix(i / 3, i % 3) = p[std::size_t(i)];
    const auto rotation = rotation_near(matrix);
    if (!rotation)
      lines.refuse(
          lines.parameters_line,
          "the matrix scales, shears or mirrors, but a pose is a rotation and a translation; register rigidly");
    return *rotation;
  }
  expect_count(lines, lines.parameters_line, 6, p.size(), "parameters");
  const Eigen::Vector3d first(p[0], p[1], p[2]);
  return name == "Euler3DTransform" ? rotation_of_angles(first, fixed.size() == 4 && fixed[3] != 0)
                                    : rotation_of_versor(lines, first);
}

}  // namespace

bool is_itk_transform_file(const std::filesystem::path& path) {
  const std::string end = files::extension_of(path);
  return end == ".tfm" || end == ".txt";
}

RigidTransform read_itk_transform(const std::filesystem::path& path, const std::string& target,
                                  const std::string& source) {
  const Lines lines = lines_of(path);
  const std::string name = class_of(lines);
  if (name != "AffineTransform" && name != "MatrixOffsetTransformBase" && name != "VersorRigid3DTransform" &&
      name != "Euler3DTransform")
    lines.refuse(lines.type_line, "the type " + in_quotes(printable(lines.type.substr(0, 60))) +
                                      " is not read; expected AffineTransform_double_3_3, as 3D Slicer writes linear "
                                      "transforms, or one of ITK's rigid ones");
  const std::vector<double> p = numbers_of(lines, lines.parameters, lines.parameters_line);
  const std::vector<double> fixed = numbers_of(lines, lines.fixed, lines.fixed_line);
  if (!(name == "Euler3DTransform" && fixed.size() == 4))
    expect_count(lines, lines.fixed_line, 3, fixed.size(), "fixed parameters");
  RigidTransform transform{target, source};
  transform.rotation = rotation_of(lines, p, fixed);
  const std::size_t last = p.size() - 3;
  const Eigen::Vector3d centre(fixed[0], fixed[1], fixed[2]), t(p[last], p[last + 1], p[last + 2]);
  transform.translation_mm = centre.isZero(0) ? t : Eigen::Vector3d(t + centre - transform.rotation * centre);
  return transform;
}

std::string itk_transform(const RigidTransform& transform) {
  std::string text = "#Insight Transform File V1.0\n#Transform 0\nTransform: AffineTransform_double_3_3\nParameters:";
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 3; ++column) text += " " + files::number(transform.rotation(row, column));
  for (const double value : transform.translation_mm) text += " " + files::number(value);
  return text + "\nFixedParameters: 0 0 0\n";
}

}  // namespace marrow::exchange
