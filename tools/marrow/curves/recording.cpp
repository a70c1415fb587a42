// SPDX-License-Identifier: Apache-2.0
#include "curves/recording.hpp"

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>

#include "curves/sequence_table.hpp"
#include "marrow/base/error.hpp"
#include "marrow/base/json_text.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/base/text_file.hpp"
#include "marrow/toolbox/files/yaml_values.hpp"
#include "marrow/toolbox/track/tra_file.hpp"
#include "run_files.hpp"

namespace marrow::cli {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

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
