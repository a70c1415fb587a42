// SPDX-License-Identifier: Apache-2.0
#pragma once
// What the files of a run, of a folder or a single file hold over time.
#include <filesystem>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "marrow/compare/curve_difference.hpp"
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

inline constexpr double kNoValue = std::numeric_limits<double>::quiet_NaN();

/// A table whose rows are frames.
struct SequenceTable {
  Times times;
  std::vector<std::string> frame_names;  ///< of the column `name`; may be empty
  std::vector<FigureOverTime> figures;
  std::optional<PosesOverTime> poses;
};

// Two recordings compared over time, figure by figure, and the same for pairs of trials.

enum class TimeBase { seconds_if_known, frames, seconds };

struct CurveSettings {
  TimeBase by = TimeBase::seconds_if_known;
  double lag = 0;                    ///< the second's times are made earlier by this; in seconds or frames
  std::vector<std::string> figures;  ///< only these, or those of these files; empty: all
};

struct ComparedFigure {
  std::string name, unit;
  bool in_seconds = false;  ///< the times are seconds, else numbers of frames
  compare::PairedCurves pair;
  compare::CurveDifference difference;
};

struct ComparedSequences {
  std::string first, second;
  std::vector<ComparedFigure> figures;  ///< in the order of the first
  std::vector<std::string> notes;       ///< what was left out or interpolated, in sentences
};

/// The unit of a figure's times: "s" or "frame".
const char* time_unit(bool in_seconds);

/// Compares all figures that both have. Poses become six figures: the place of the model's origin in the world (x_mm,
/// y_mm, z_mm), and the turn since the first pose of the first recording, as a rotation vector along the world's axes
/// (turn_x_deg ...). Throws Error if a recording holds no sequence, if they have no figure in common, if a wanted
/// figure is not there, or if no figure could be compared.
ComparedSequences compare_sequences(const Recording& first, const Recording& second, const CurveSettings& settings);

/// A figure's difference curves in several trials.
struct TrialFigure {
  std::string name, unit;
  bool in_seconds = false;
  std::vector<double> at;  ///< the times at which all trials have a difference
  std::vector<std::string> trials;
  std::vector<std::vector<double>> differences;    ///< of each trial, at these times
  double bias = 0;                                 ///< mean of the trials' mean differences
  std::optional<compare::Interval> interval;       ///< of `bias`, by Student's t over the trials
  std::optional<compare::CurveBand> band;          ///< nothing with fewer than compare::kFewestTrials
  std::vector<std::pair<double, double>> outside;  ///< times during which the simultaneous band is without 0
};

struct ComparedTrials {
  std::string first, second;
  std::vector<TrialFigure> figures;
  std::vector<std::string> notes;
};

/// One pair of recordings of a trial.
struct TrialPair {
  std::string name;  ///< TRIAL or TRIAL/REPETITION; the mean of a trial's repetitions counts once
  Recording first, second;
};

/// Throws Error as compare_sequences() does.
ComparedTrials compare_trials(const std::vector<TrialPair>& pairs, const CurveSettings& settings);

// What a comparison over time says: in the terminal, as JSON, as a table of all curves, and as a page.

/// All that `marrow curves` compared. Either list may be empty.
struct CurveAnswer {
  std::vector<ComparedSequences> sequences;
  std::vector<ComparedTrials> trials;
};

/// "way/bone.axial_deg: the second is 0.12 deg larger on average, ..."
std::string sentence_of(const ComparedFigure& figure);
std::string sentence_of(const TrialFigure& figure);

void print(const CurveAnswer& answer);
nlohmann::json json_of(const CurveAnswer& answer);

/// Writes curves.json, curves.csv and report.html into a folder that is new or empty. Throws Error for another one.
void write_curves(const CurveAnswer& answer, const std::filesystem::path& folder);

}  // namespace marrow::cli
