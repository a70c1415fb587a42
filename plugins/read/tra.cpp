// SPDX-License-Identifier: Apache-2.0
// Reads a bone's poses from Autoscoper's format (.tra): a line a frame, the 16 numbers of the 4x4 matrix world from
// bone row by row, in mm. NaN stands for a frame in which the bone was not tracked.
#include <charconv>
#include <cmath>
#include <marrow/domain/decompositions.hpp>
#include <marrow/plugin.hpp>
#include <sstream>

#include "marrow/toolbox/files/input_file.hpp"
#include "marrow/toolbox/track/sequence.hpp"
#include "marrow/toolbox/track/track_state.hpp"

namespace {

using namespace marrow;
using track::AutoscoperTrack;

struct Options {
  std::filesystem::path path;
};

struct Tra {
  AutoscoperTrack track;
  List<Pose> poses;
};

constexpr std::uintmax_t kMostBytes = 256u << 20;

[[noreturn]] void refuse(const std::filesystem::path& path, std::size_t line, const std::string& what) {
  throw Error(path.string() + ":" + std::to_string(line) + ": " + what);
}

/// The 16 numbers of a line.
std::array<double, 16> numbers_of(std::string_view text, const std::filesystem::path& path, std::size_t line) {
  std::array<double, 16> numbers;
  std::size_t count = 0;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find_first_of(", \t"), text.size());
    std::string_view word = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    if (word.empty()) continue;
    if (word.front() == '+') word.remove_prefix(1);
    double value = 0;
    const auto [stop, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (error != std::errc() || stop != word.data() + word.size())
      refuse(path, line, "expected a number, got '" + std::string(word.substr(0, 40)) + "'");
    if (count < numbers.size()) numbers[count] = value;
    ++count;
  }
  if (count != numbers.size())
    refuse(path, line, "expected the 16 numbers of a 4x4 matrix, got " + std::to_string(count));
  return numbers;
}

std::optional<RigidTransform> pose_of(const std::array<double, 16>& m, const std::filesystem::path& path,
                                      std::size_t line) {
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
    refuse(path, line,
           "the matrix is no rigid motion; Autoscoper writes 4x4 matrices row by row, with 0, 0, 0, 1 at the end");
  pose.rotation = nearest_rotation(pose.rotation);
  return pose;
}

Tra read_tra(const Options& options) {
  const std::string text = files::read_bytes(options.path, kMostBytes);
  std::istringstream lines(text);
  Tra result;
  std::string line;
  for (std::size_t number = 1; std::getline(lines, line); ++number) {
    if (!line.empty() && line.back() == '\r') line.pop_back();
    if (line.find_first_not_of(", \t") == std::string::npos) continue;
    result.track.world_from_bone.push_back(pose_of(numbers_of(line, options.path, number), options.path, number));
    const auto& pose = result.track.world_from_bone.back();
    if (!pose) continue;
    Pose found;
    found.world_from_model = *pose;
    result.poses.add(track::frame_name(result.track.world_from_bone.size()), found);
  }
  if (result.poses.empty()) throw Error(options.path.string() + ": there is no tracked frame in it");
  return result;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("read.tra", read_tra)
      .summary("Reads a bone's poses from a file of Autoscoper (.tra)")
      .out("track", &Tra::track, "the poses of all frames")
      .out("poses", &Tra::poses, "poses of the frames in which the bone was tracked, named by their number",
           over("frame"))
      .option("path", &Options::path, "the file, one line a frame", required());
}
