// SPDX-License-Identifier: Apache-2.0
#pragma once
// Two recordings compared over time, figure by figure, and the same for pairs of trials.
#include <string>
#include <vector>

#include "curves/recording.hpp"
#include "marrow/compare/curve_band.hpp"
#include "marrow/compare/curve_difference.hpp"

namespace marrow::cli {

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

}  // namespace marrow::cli
