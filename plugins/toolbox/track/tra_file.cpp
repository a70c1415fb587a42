// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/track/tra_file.hpp"

#include <cmath>
#include <sstream>

#include "marrow/domain/decompositions.hpp"
#include "marrow/toolbox/files/input_file.hpp"

namespace marrow::track {
namespace {

constexpr std::uintmax_t kMostBytes = 256u << 20;

/// A line of a file, to say what is wrong with it.
struct Line {
  const std::filesystem::path& path;
  std::size_t number;
  std::string_view text;

  std::string place() const { return formatted("{}:{}", path.string(), number); }
};

/// The 16 numbers of a line.
std::array<double, 16> numbers_of(const Line& line) {
  std::array<double, 16> numbers;
  std::size_t count = 0, at = 0;
  while (at < line.text.size()) {
    const std::size_t begin = at, end = std::min(line.text.find_first_of(", \t", at), line.text.size());
    at = end + 1;
    const std::string_view word = line.text.substr(begin, end - begin);
    if (word.empty()) continue;
    const auto value = parsed_number(word);
    if (!value)
      throw Error(formatted("{}:{}: expected a number, got '{}'", line.place(), begin + 1, word.substr(0, 40)));
    if (count < numbers.size()) numbers[count] = *value;
    ++count;
  }
  if (count != numbers.size())
    throw Error(
        formatted("{}: expected the 16 numbers of a 4x4 matrix, got {}{}", line.place(), count,
                  count > numbers.size() ? "; a number with a decimal comma counts twice: write 12.5, not 12,5" : ""));
  return numbers;
}

/// Whether the line has commas with only blanks between them. Programs for tables write NaN in this way.
bool has_only_empty_cells(std::string_view text) {
  return text.find(',') != std::string_view::npos && text.find_first_not_of(", \t") == std::string_view::npos;
}

std::optional<RigidTransform> pose_of(const std::array<double, 16>& m, const Line& line) {
  if (std::any_of(m.begin(), m.end(), [](double value) { return std::isnan(value); })) return std::nullopt;
  RigidTransform pose{"world", "ct"};
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) pose.rotation(row, column) = m[std::size_t(4 * row + column)];
    pose.translation_mm[row] = m[std::size_t(4 * row + 3)];
  }
  constexpr double kTolerance = 1e-3;  // files have few digits
  const bool is_rotation =
      pose.rotation.allFinite() && pose.translation_mm.allFinite() && pose.rotation.determinant() > 0 &&
      (pose.rotation * pose.rotation.transpose() - Eigen::Matrix3d::Identity()).norm() < kTolerance;
  if (!is_rotation || std::abs(m[12]) + std::abs(m[13]) + std::abs(m[14]) + std::abs(m[15] - 1) > kTolerance)
    throw Error(line.place() +
                ": the matrix is no rigid motion; Autoscoper writes 4x4 matrices row by row, with 0, 0, 0, 1 at the "
                "end");
  pose.rotation = nearest_rotation(pose.rotation);
  return pose;
}

constexpr const char* kFrame = "autoscoper";

}  // namespace

AutoscoperTrack read_tra_file(const std::filesystem::path& path) {
  std::istringstream lines(files::read_text(path, kMostBytes));
  AutoscoperTrack track;
  std::string text;
  for (std::size_t number = 1; std::getline(lines, text); ++number) {
    if (text.find_first_not_of(" \t") == std::string::npos) continue;
    const Line line{path, number, text};
    if (has_only_empty_cells(text))
      track.world_from_bone.emplace_back();
    else
      track.world_from_bone.push_back(pose_of(numbers_of(line), line));
  }
  return track;
}

std::string tra_text(const AutoscoperTrack& track) {
  std::string text;
  for (const auto& pose : track.world_from_bone) {
    for (int row = 0; row < 4; ++row)
      for (int column = 0; column < 4; ++column) {
        const double value = !pose        ? 0
                             : row == 3   ? double(column == 3)
                             : column < 3 ? pose->rotation(row, column)
                                          : pose->translation_mm[row];
        text += (row + column > 0 ? "," : "") + (pose ? formatted("{:.17g}", value) : "NaN");
      }
    text += "\n";
  }
  return text;
}

RigidTransform autoscoper_from_volume(const Grid& grid) {
  const Eigen::Vector3d half = grid.spacing_mm / 2;
  const Eigen::Vector3d first_mm(half.x(), grid.size[1] * grid.spacing_mm.y() - half.y(), -half.z());
  RigidTransform transform{kFrame, grid.frame};
  transform.rotation = Eigen::Vector3d(1, -1, -1).asDiagonal() * grid.direction.transpose();
  transform.translation_mm = first_mm - transform.rotation * grid.origin_mm;
  return transform;
}

RigidTransform world_from_volume(const RigidTransform& world_from_autoscoper, const Grid& grid) {
  RigidTransform pose = world_from_autoscoper;
  pose.source = kFrame;
  return pose * autoscoper_from_volume(grid);
}

RigidTransform world_from_autoscoper(const RigidTransform& world_from_volume, const Grid& grid) {
  RigidTransform pose = world_from_volume * inverse(autoscoper_from_volume(grid));
  pose.source = world_from_volume.source;  // a file of poses names no frames
  return pose;
}

}  // namespace marrow::track
