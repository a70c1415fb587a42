// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/exchange/autoscoper_trial.hpp"

#include <algorithm>
#include <sstream>

#include "marrow/base/diagnostics.hpp"
#include "marrow/base/error.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/base/printable.hpp"
#include "marrow/toolbox/files/header_lines.hpp"

namespace marrow::exchange {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kMostBytesOfTrial = 1u << 20;

/// RenderingResolution: as Autoscoper's documentation once called it.
const std::vector<std::string> kPassedOver{"RenderResolution", "RenderingResolution", "OptimizationOffsets",
                                           "TrackingFolder", "FilterFolder"};
const std::vector<std::string> kRead{"Version",    "mayaCam_csv", "CameraRootDir", "VolumeFile",
                                     "VolumeFlip", "VoxelSize",   "MeshFile"};

struct TrialLine {
  int number;
  std::string key, value;
};

/// Reads the lines of a trial and notes all faults.
class TrialText {
 public:
  explicit TrialText(const fs::path& path) : path_(path) {
    const std::string text = files::read_text(path, kMostBytesOfTrial);
    faults_.remember(path.string(), text);
    std::istringstream stream(text);
    std::string line;
    for (int number = 1; std::getline(stream, line); ++number) {
      line = files::trimmed(line);
      if (line.empty() || line[0] == '#') continue;
      const std::size_t end = line.find_first_of(" \t");
      lines_.push_back(
          {number, line.substr(0, end), end == std::string::npos ? std::string() : files::trimmed(line.substr(end))});
      if (lines_.back().value.empty()) fault(lines_.back(), "there is no value behind it");
    }
  }

  std::vector<TrialLine> with_key(const std::string& key) const {
    std::vector<TrialLine> found;
    std::copy_if(lines_.begin(), lines_.end(), std::back_inserter(found),
                 [&](const TrialLine& one) { return one.key == key && !one.value.empty(); });
    return found;
  }

  std::vector<TrialPath> paths(const std::string& key) {
    std::vector<TrialPath> found;
    for (const TrialLine& line : with_key(key)) {
      std::string text = line.value;
      std::replace(text.begin(), text.end(), '\\', '/');
      if (text.size() > 1 && text[1] == ':')
        fault(line, "is a path of another machine", "write it from the trial's folder, as Volumes/radius.tif");
      while (text.size() > 1 && text.back() == '/') text.pop_back();
      found.push_back({(path_.parent_path() / text).lexically_normal(), key, line.value, line.number});
    }
    return found;
  }

  /// The three numbers of a line.
  Eigen::Vector3d three(const TrialLine& line, const std::string& expected) {
    const std::vector<std::string> words = files::words_of(line.value);
    Eigen::Vector3d numbers = Eigen::Vector3d::Constant(1);
    bool is_good = words.size() == 3;
    for (std::size_t i = 0; is_good && i < 3; ++i) {
      const std::optional<double> number = files::number_of(words[i]);
      is_good = number.has_value();
      if (is_good) numbers[Eigen::Index(i)] = *number;
    }
    if (!is_good) fault(line, "expected " + expected + ", got " + in_quotes(printable(line.value.substr(0, 60))));
    return numbers;
  }

  std::vector<std::string> unknown_lines() const {
    std::vector<std::string> known = kRead, remarks;
    known.insert(known.end(), kPassedOver.begin(), kPassedOver.end());
    for (const TrialLine& line : lines_) {
      if (std::find(known.begin(), known.end(), line.key) != known.end()) continue;
      const std::string near = suggestion(line.key, known);
      remarks.push_back(formatted("{}:{}: the key {} is not known, so the line does not count{}", path_.string(),
                                  line.number, in_quotes(printable(line.key)), near.empty() ? "" : "; " + near));
    }
    return remarks;
  }

  void fault(const TrialLine& line, const std::string& text, const std::string& hint = {}) {
    faults_.add({path_.string(), line.number, 1}, line.key + ": " + text, hint);
  }
  void fault(const std::string& text, const std::string& hint = {}) { faults_.add({path_.string()}, text, hint); }
  void finish() const {
    if (!faults_.empty()) throw Error(faults_.text());
  }

 private:
  fs::path path_;
  std::vector<TrialLine> lines_;
  Diagnostics faults_;
};

void check_version(TrialText& text) {
  for (const TrialLine& line : text.with_key("Version"))
    if (line.value != "1.0" && line.value != "1.1" && line.value != "1.2")
      text.fault(line, "expected 1.0, 1.1 or 1.2, got " + in_quotes(printable(line.value)));
}

std::vector<std::string> flips_of(TrialText& text, const TrialLine& line) {
  const Eigen::Vector3d numbers = text.three(line, "0 or 1 for each of x, y and z");
  std::vector<std::string> axes;
  for (int k = 0; k < 3; ++k) {
    if (numbers[k] != 0 && numbers[k] != 1) {
      text.fault(line, "expected 0 or 1 for each of x, y and z, got " + in_quotes(printable(line.value)));
      break;
    }
    if (numbers[k] == 1) axes.push_back(std::string(1, "xyz"[k]));
  }
  return axes;
}

std::vector<TrialVolume> volumes_of(TrialText& text) {
  std::vector<TrialVolume> volumes;
  for (TrialPath& file : text.paths("VolumeFile")) volumes.push_back({std::move(file), {}, {}, {}});
  if (volumes.empty()) text.fault("there is no VolumeFile", "each bone has a line, as  VolumeFile Volumes/radius.tif");
  const std::vector<TrialLine> sizes = text.with_key("VoxelSize"), flips = text.with_key("VolumeFlip");
  const std::vector<TrialPath> meshes = text.paths("MeshFile");
  const auto check_count = [&](std::size_t count, const std::string& key, bool may_be_none) {
    if (count == volumes.size() || (count == 0 && may_be_none)) return true;
    text.fault(formatted("there are {} of VolumeFile and {} of {}", volumes.size(), count, key),
               "the n-th one belongs to the n-th volume, so give one for each");
    return false;
  };
  if (check_count(sizes.size(), "VoxelSize", false))
    for (std::size_t i = 0; i < volumes.size(); ++i) {
      volumes[i].voxel_size_mm = text.three(sizes[i], "the voxel's lengths along x, y and z in mm");
      if (!(volumes[i].voxel_size_mm.minCoeff() > 0))
        text.fault(sizes[i], "expected lengths above 0, got " + in_quotes(printable(sizes[i].value)));
    }
  if (check_count(flips.size(), "VolumeFlip", true))
    for (std::size_t i = 0; i < flips.size(); ++i) volumes[i].flip = flips_of(text, flips[i]);
  if (check_count(meshes.size(), "MeshFile", true))
    for (std::size_t i = 0; i < meshes.size(); ++i) volumes[i].mesh = meshes[i];
  return volumes;
}

std::string names_of_volumes(const std::vector<const TrialVolume*>& volumes) {
  std::string names;
  for (const TrialVolume* volume : volumes) names += (names.empty() ? "" : ", ") + volume->name();
  return names;
}

}  // namespace

AutoscoperTrial read_autoscoper_trial(const fs::path& path) {
  TrialText text(path);
  check_version(text);
  AutoscoperTrial trial;
  trial.cameras = text.paths("mayaCam_csv");
  trial.frame_folders = text.paths("CameraRootDir");
  if (trial.cameras.empty())
    text.fault("there is no mayaCam_csv", "each camera has a line, as  mayaCam_csv Calibration/cam01.csv");
  if (trial.cameras.size() != trial.frame_folders.size())
    text.fault(formatted("there are {} of mayaCam_csv and {} of CameraRootDir", trial.cameras.size(),
                         trial.frame_folders.size()),
               "the n-th folder holds the frames of the n-th camera, so give one for each");
  trial.volumes = volumes_of(text);
  trial.unknown = text.unknown_lines();
  text.finish();
  return trial;
}

const TrialVolume& volume_of_bone(const AutoscoperTrial& trial, const std::string& bone, const std::string& what) {
  std::vector<const TrialVolume*> all, fitting;
  for (const TrialVolume& volume : trial.volumes) {
    all.push_back(&volume);
    if (volume.name() == bone) return volume;
    if (volume.name().find(bone) != std::string::npos) fitting.push_back(&volume);
  }
  if (fitting.size() == 1) return *fitting[0];
  if (bone.empty())
    throw Error(what + ": has several volumes; name one by bone, in whole or in part: " + names_of_volumes(all));
  if (fitting.empty())
    throw Error(what + ": no volume has " + in_quotes(bone) + " in its name; there are " + names_of_volumes(all));
  throw Error(what + ": " + in_quotes(bone) + " is in the names of several volumes: " + names_of_volumes(fitting) +
              "; name one of them");
}

}  // namespace marrow::exchange
