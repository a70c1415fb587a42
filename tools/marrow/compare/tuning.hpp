// SPDX-License-Identifier: Apache-2.0
#pragma once
// What an optimizer found for the options under 'tune' of an experiment.
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "marrow/compare/cell.hpp"

namespace marrow::cli {

/// The training cases and starts at one point.
struct TuningPoint {
  std::vector<double> values;  ///< of the options; empty for the variant of the file
  /// What the optimizer improves: the mean over all runs, where each failed or worse run counts as TuneRule::failed_as.
  /// So it is not the mean of the figure.
  double score = 0;
  std::optional<double> mean;  ///< of the unchanged figure, over the runs that have it; nothing if none has it
  std::size_t runs = 0;
  std::size_t failed = 0;    ///< runs without the figure: the cell failed, or a node in it that may fail
  std::size_t capped = 0;    ///< runs whose figure is worse than TuneRule::failed_as
  std::string refused = {};  ///< why the pipeline does not take these values together; then it was not run
};

/// The score of rows that one variant made.
TuningPoint point_of(const compare::Experiment& experiment, const std::vector<double>& values,
                     const std::vector<compare::CellRow>& rows);

struct Tuning {
  compare::TuneRule rule;
  TuningPoint untuned;                ///< the variant of the file
  std::vector<TuningPoint> points;    ///< in the order in which they were tried; equal ones once
  std::optional<std::size_t> best;    ///< nothing if no point is better than failed runs only
  std::string figure, unit, variant;  ///< names of the metric and of the variant that was tuned
  bool higher_is_better = false;
  std::string curves;           ///< JSON of the response curves over all points, as curves_json() makes it
  std::string stopped_because;  ///< the optimizer's own words

  void add(TuningPoint point);
  bool is_better() const;  ///< whether the best point is better than the untuned variant, on the training cases

 private:
  bool is_better_score(double one, double other) const { return higher_is_better ? one > other : one < other; }
};

/// "edges.high 72.3, edges.low 40".
std::string values_text(const compare::TuneRule& rule, const std::vector<double>& values);
/// What a score is: "mean mTRE with failed and worse runs counted as 20 mm".
std::string score_rule(const Tuning& tuning);
/// "0.41 mm (mean 0.41 mm of 20 runs)".
std::string score_text(const Tuning& tuning, const TuningPoint& point);
/// "tuned on 20 cases by NODE, 31 points; score: SCORE_RULE; canny: 0.41 mm (mean 0.41 mm of 20 runs); edges.high 72.3:
/// 0.23 mm (mean 0.23 mm of 20 runs)".
std::string sentence(const Tuning& tuning);
nlohmann::json tuning_json(const Tuning& tuning);

}  // namespace marrow::cli
