// SPDX-License-Identifier: Apache-2.0
#pragma once
// What the files of a run, of a folder or a single file hold over time.
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "marrow/domain/transform.hpp"

namespace marrow::cli {

/// When the values of a sequence were taken.
struct Times {
  std::vector<double> frames;   ///< their numbers; rising
  std::vector<double> seconds;  ///< of the same frames; empty if they are not known
};

/// NaN is a frame without a value.
struct FigureOverTime {
  std::string name, unit;
  Times times;
  std::vector<double> values;
};

struct PosesOverTime {
  std::string name;
  Times times;
  std::vector<std::optional<RigidTransform>> world_from_model;
};

struct Recording {
  std::string name;  ///< the path as it was given
  std::vector<FigureOverTime> figures;
  std::vector<PosesOverTime> poses;

  bool is_empty() const { return figures.empty() && poses.empty(); }
};

/// Reads the outputs of a run (a folder with run.json), all files below another folder, or one file:
/// - tables (CSV) with a column `frame` or `time_s`: a figure for each column of numbers. A row with 0 in the column
///   `found` is a gap. Columns m11 ... m34_mm are the pose as the trajectory of a tracked bone has it.
/// - Autoscoper's .tra: a pose a line.
/// - figures of merit (.json) and poses (.yaml) of which each frame has a file: NAME/0001.json, NAME/0001/ITEM.json.
///
/// A figure is named after its file and column: "way/bone.axial_deg"; of a single file, after the column alone. Other
/// files are left out. Throws Error if the path does not exist, or if a file of one of these kinds is damaged.
Recording read_recording(const std::filesystem::path& path);

/// Throws Error if the recording holds nothing over time. It says what it looked for.
void expect_sequence(const Recording& recording);

}  // namespace marrow::cli
