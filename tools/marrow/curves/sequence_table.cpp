// SPDX-License-Identifier: Apache-2.0
#include "curves/sequence_table.hpp"

#include <algorithm>
#include <array>
#include <sstream>

#include "compare/csv.hpp"
#include "marrow/base/error.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/base/text_file.hpp"

namespace marrow::cli {
namespace {

namespace fs = std::filesystem;

struct Cells {
  fs::path path;
  std::vector<std::string> header;
  std::vector<std::vector<std::string>> rows;
  std::vector<std::size_t> lines;  ///< of the rows in the file

  std::optional<std::size_t> column(const std::string& title) const {
    const auto at = std::find(header.begin(), header.end(), title);
    return at == header.end() ? std::nullopt : std::optional(std::size_t(at - header.begin()));
  }
};

Cells cells_of_file(const fs::path& path) {
  Cells cells{path, {}, {}, {}};
  std::istringstream text(read_text_file(path, kMostRecordBytes));
  std::size_t line = 0;
  for (std::string row; std::getline(text, row);) {
    if (++line == 1 && row.starts_with("\xEF\xBB\xBF")) row.erase(0, 3);
    if (row.find_first_not_of(" \r\t") == std::string::npos) continue;
    if (cells.header.empty()) {
      cells.header = csv_cells(row);
      continue;
    }
    cells.rows.push_back(csv_cells(row));
    cells.lines.push_back(line);
  }
  return cells;
}

void expect_whole_rows(const Cells& cells) {
  for (std::size_t i = 0; i < cells.rows.size(); ++i)
    if (cells.rows[i].size() != cells.header.size())
      throw Error(formatted("{}, line {}: it has {} cells, and the header {}", cells.path.string(), cells.lines[i],
                            cells.rows[i].size(), cells.header.size()));
}

/// The numbers of a column. Nothing if it holds a text, or no number at all. Empty cells are gaps.
std::optional<std::vector<double>> numbers_of(const Cells& cells, std::size_t column) {
  std::vector<double> values;
  bool any = false;
  for (const std::vector<std::string>& row : cells.rows) {
    const auto value = parsed_number(row[column]);
    if (!value && !row[column].empty()) return std::nullopt;
    any = any || value;
    values.push_back(value.value_or(kNoValue));
  }
  return any ? std::optional(values) : std::nullopt;
}

std::vector<double> rising(const Cells& cells, std::size_t column) {
  std::vector<double> values;
  for (std::size_t i = 0; i < cells.rows.size(); ++i) {
    const auto value = parsed_number(cells.rows[i][column]);
    const std::string place =
        formatted("{}, line {}, column '{}': ", cells.path.string(), cells.lines[i], cells.header[column]);
    if (!value || !std::isfinite(*value)) throw Error(place + "'" + cells.rows[i][column] + "' is not a number");
    if (!values.empty() && *value <= values.back())
      throw Error(place + cells.rows[i][column] + " does not come after " + short_number(values.back(), 9) +
                  "; rows must be in the order of time");
    values.push_back(*value);
  }
  return values;
}

std::string unit_of(const std::string& title) {
  for (const std::string unit : {"deg", "mm", "px", "s"})
    if (title.ends_with("_" + unit)) return unit;
  return "";
}

constexpr std::array kOfPose{"m11", "m12",    "m13", "m14_mm", "m21", "m22",
                             "m23", "m24_mm", "m31", "m32",    "m33", "m34_mm"};

std::optional<PosesOverTime> poses_of(const Cells& cells, const std::vector<bool>& found) {
  std::vector<std::vector<double>> numbers;
  for (const char* title : kOfPose) {
    const auto column = cells.column(title);
    const auto values = column ? numbers_of(cells, *column) : std::nullopt;
    if (!values) return std::nullopt;
    numbers.push_back(*values);
  }
  PosesOverTime poses;
  for (std::size_t i = 0; i < cells.rows.size(); ++i) {
    RigidTransform pose;
    bool is_known = found[i];
    for (int k = 0; k < 12; ++k) {
      const double value = numbers[std::size_t(k)][i];
      is_known = is_known && std::isfinite(value);
      (k % 4 == 3 ? pose.translation_mm[k / 4] : pose.rotation(k / 4, k % 4)) = value;
    }
    poses.world_from_model.push_back(is_known ? std::optional(pose) : std::nullopt);
  }
  return poses;
}

std::vector<FigureOverTime> figures_of(const Cells& cells, const std::vector<bool>& found) {
  std::vector<FigureOverTime> figures;
  for (std::size_t column = 0; column < cells.header.size(); ++column) {
    const std::string& title = cells.header[column];
    const bool is_of_pose = std::find(kOfPose.begin(), kOfPose.end(), title) != kOfPose.end();
    if (is_of_pose || title == "frame" || title == "time_s" || title == "name" || title == "found") continue;
    if (title.starts_with("deviation_")) continue;  // how exact a motion is, not a motion
    auto values = numbers_of(cells, column);
    if (!values) continue;
    for (std::size_t i = 0; i < found.size(); ++i)
      if (!found[i] || !std::isfinite((*values)[i])) (*values)[i] = kNoValue;
    figures.push_back({title, unit_of(title), {}, *values});
  }
  return figures;
}

}  // namespace

SequenceTable read_sequence_table(const fs::path& path, const std::string& name) {
  const Cells cells = cells_of_file(path);
  SequenceTable table;
  const auto frame = cells.column("frame"), seconds = cells.column("time_s"), title = cells.column("name");
  if ((!frame && !seconds) || cells.rows.empty()) return table;
  expect_whole_rows(cells);
  if (seconds) table.times.seconds = rising(cells, *seconds);
  if (frame) table.times.frames = rising(cells, *frame);
  for (std::size_t i = 0; !frame && i < cells.rows.size(); ++i) table.times.frames.push_back(double(i + 1));
  if (title)
    for (const std::vector<std::string>& row : cells.rows) table.frame_names.push_back(row[*title]);
  std::vector<bool> found(cells.rows.size(), true);
  if (const auto column = cells.column("found"))
    for (std::size_t i = 0; i < found.size(); ++i) found[i] = parsed_number(cells.rows[i][*column]) != 0.0;
  table.figures = figures_of(cells, found);
  for (FigureOverTime& figure : table.figures) {
    figure.name = name.empty() ? figure.name : name + "." + figure.name;
    figure.times = table.times;
  }
  table.poses = poses_of(cells, found);
  if (table.poses) {
    table.poses->name = name;
    table.poses->times = table.times;
  }
  return table;
}

}  // namespace marrow::cli
