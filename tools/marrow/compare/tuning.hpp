// SPDX-License-Identifier: Apache-2.0
#pragma once
// What an optimizer found for the options under 'tune' of an experiment.
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "marrow/compare/tune_rule.hpp"

namespace marrow::cli {

/// The training cases and starts at one point.
struct TuningPoint {
  std::vector<double> values;  ///< of the options; empty for the variant of the file
  double figure = 0;           ///< mean over all runs; one that failed, or is worse than that, counts as TuneRule says
  std::size_t runs = 0, failed = 0;
  std::string refused = {};  ///< why the pipeline does not take these values together; then it counts as failed
};

struct Tuning {
  compare::TuneRule rule;
  TuningPoint untuned;              ///< the variant of the file
  std::vector<TuningPoint> points;  ///< in the order in which they were tried; equal ones once
  std::size_t best = 0;
  std::string figure, unit, variant;  ///< names of the metric and of the variant that was tuned
  bool higher_is_better = false;
  std::string curves;           ///< JSON of the response curves over all points, as curves_json() makes it
  std::string stopped_because;  ///< the optimizer's own words

  bool is_better() const;  ///< than the untuned variant, on the training cases
};

/// "edges.high 72.3, edges.low 40".
std::string values_text(const compare::TuneRule& rule, const std::vector<double>& values);
/// "tuned on 20 cases by NODE, 31 points: mean mTRE 0.41 mm for canny, 0.23 mm at edges.high 72.3".
std::string sentence(const Tuning& tuning);
nlohmann::json tuning_json(const Tuning& tuning);

}  // namespace marrow::cli
