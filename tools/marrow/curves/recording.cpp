// SPDX-License-Identifier: Apache-2.0
#include "curves/curves.hpp"

#include <algorithm>
#include <array>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>

#include "compare/text_table.hpp"
#include "marrow/base/json_text.hpp"
#include "marrow/base/text_file.hpp"
#include "marrow/toolbox/files/yaml_values.hpp"
#include "marrow/toolbox/track/tra_file.hpp"
#include "run_files.hpp"

namespace marrow::cli {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

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

/// Reads a CSV file with a header. `name` is the first part of the names of what it holds. Without a column `frame`,
/// rows are counted from 1. The table is empty if the file has neither that column nor `time_s`. Throws Error if the
/// frames or times are no rising numbers, or a row is shorter than the header. It names the line.
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

struct File {
  fs::path path, name;  ///< `name`: below outputs/ or the folder
};

std::vector<File> files_of_run(const fs::path& folder) {
  std::vector<File> files;
  const json record = read_record(folder);
  for (const json& output : record.value("outputs", json::array()))
    for (const json& file : output.value("files", json::array()))
      if (const auto path = file_of_run(folder, file.get<std::string>()))
        files.push_back({*path, fs::path(file.get<std::string>()).lexically_relative("outputs")});
  return files;
}

std::vector<File> files_below(const fs::path& folder) {
  std::vector<File> files;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder))
    if (entry.is_regular_file()) files.push_back({entry.path(), entry.path().lexically_relative(folder)});
  return files;
}

/// The number of a frame, if the name is one.
std::optional<double> frame_of(const std::string& name) {
  const bool is_number = !name.empty() && name.size() <= 9 &&
                         std::all_of(name.begin(), name.end(), [](char c) { return c >= '0' && c <= '9'; });
  return is_number ? parsed_number(name) : std::nullopt;
}

/// "joint/0007" is frame 7 of "joint".
struct NameOfFrame {
  double frame = 0;
  std::string name;
};

std::optional<NameOfFrame> frame_and_name(const fs::path& name) {
  NameOfFrame result;
  bool has_frame = false;
  const fs::path parts = fs::path(name).replace_extension();
  for (const fs::path& part : parts) {
    const auto frame = has_frame ? std::nullopt : frame_of(part.string());
    has_frame = has_frame || frame;
    if (frame)
      result.frame = *frame;
    else
      result.name += (result.name.empty() ? "" : "/") + part.string();
  }
  return has_frame ? std::optional(result) : std::nullopt;
}

class Reader {
 public:
  explicit Reader(Recording& recording) : recording_(recording) {}

  void add(const File& file, bool alone) {
    const std::string extension = file.path.extension().string();
    const std::string name = alone ? "" : fs::path(file.name).replace_extension().generic_string();
    if (extension == ".csv") add_table(file.path, name);
    if (extension == ".tra") add_tra(file.path, name);
    const auto of_frame = frame_and_name(file.name);
    if (of_frame && extension == ".json") add_metrics(file.path, *of_frame);
    if (of_frame && extension == ".yaml") add_pose(file.path, *of_frame);
  }

  void finish() {
    for (auto& [name, figure] : figures_) {
      FigureOverTime result{name, figure.unit, {}, {}};
      for (const auto& [frame, value] : figure.values) {
        result.times.frames.push_back(frame);
        result.values.push_back(value);
      }
      recording_.figures.push_back(std::move(result));
    }
    for (auto& [name, poses] : poses_) {
      PosesOverTime result{name, {}, {}};
      for (const auto& [frame, pose] : poses) {
        result.times.frames.push_back(frame);
        result.world_from_model.push_back(pose);
      }
      recording_.poses.push_back(std::move(result));
    }
    add_seconds();
  }

 private:
  struct OfFrames {
    std::string unit;
    std::map<double, double> values;
  };

  void add_table(const fs::path& path, const std::string& name) {
    SequenceTable table = read_sequence_table(path, name);
    for (std::size_t i = 0; i < table.frame_names.size() && i < table.times.seconds.size(); ++i)
      if (const auto frame = frame_of(table.frame_names[i])) seconds_.emplace(*frame, table.times.seconds[i]);
    for (FigureOverTime& figure : table.figures) recording_.figures.push_back(std::move(figure));
    if (table.poses) recording_.poses.push_back(std::move(*table.poses));
  }
  void add_tra(const fs::path& path, const std::string& name) {
    PosesOverTime poses{name, {}, track::read_tra_file(path).world_from_bone};
    for (std::size_t i = 0; i < poses.world_from_model.size(); ++i) poses.times.frames.push_back(double(i + 1));
    recording_.poses.push_back(std::move(poses));
  }
  void add_metrics(const fs::path& path, const NameOfFrame& of) {
    const json file = parse_json(read_text_file(path, kMostRecordBytes), path.string());
    if (!file.is_object() || !file.contains("metrics")) return;
    for (const json& metric : file["metrics"]) {
      OfFrames& figure = figures_[(of.name.empty() ? "" : of.name + ".") + metric.at("name").get<std::string>()];
      figure.unit = metric.value("unit", "");
      const json& value = metric.at("value");
      figure.values[of.frame] = value.is_number() ? value.get<double>() : kNoValue;
    }
  }
  void add_pose(const fs::path& path, const NameOfFrame& of) {
    if (read_text_file(path, kMostRecordBytes).find("marrow-pose") == std::string::npos) return;
    poses_[of.name][of.frame] = files::read_pose_file(path).world_from_model;
  }
  /// A run's tables say at which second a frame is; files of single frames do not.
  void add_seconds() {
    const auto add = [&](Times& times) {
      if (!times.seconds.empty()) return;
      std::vector<double> seconds;
      for (const double frame : times.frames)
        if (const auto at = seconds_.find(frame); at != seconds_.end()) seconds.push_back(at->second);
      if (seconds.size() == times.frames.size()) times.seconds = seconds;
    };
    for (FigureOverTime& figure : recording_.figures) add(figure.times);
    for (PosesOverTime& poses : recording_.poses) add(poses.times);
  }

  Recording& recording_;
  std::map<std::string, OfFrames> figures_;
  std::map<std::string, std::map<double, std::optional<RigidTransform>>> poses_;
  std::map<double, double> seconds_;  ///< by the number in a frame's name
};

}  // namespace

Recording read_recording(const fs::path& path) {
  std::error_code error;
  if (!fs::exists(path, error)) throw Error(path.string() + ": no such file or folder");
  Recording recording{path.string(), {}, {}};
  Reader reader(recording);
  if (!fs::is_directory(path, error)) {
    reader.add({path, path.filename()}, true);
  } else {
    std::vector<File> files = fs::exists(path / "run.json", error) ? files_of_run(path) : files_below(path);
    std::sort(files.begin(), files.end(), [](const File& a, const File& b) { return a.name < b.name; });
    for (const File& file : files) reader.add(file, false);
  }
  reader.finish();
  return recording;
}

void expect_sequence(const Recording& recording) {
  if (!recording.is_empty()) return;
  throw Error(
      recording.name +
      " holds no sequence: no table (CSV) with a column 'frame' or 'time_s', no .tra, and no figures or poses "
      "of which each frame has a file (joint/0001.json); have the pipeline give one among its outputs, by a node "
      "that 'marrow list track' shows");
}

}  // namespace marrow::cli
