// SPDX-License-Identifier: Apache-2.0
#include "compare/tuning.hpp"
#include "marrow/domain/number_text.hpp"

#include <nlohmann/json.hpp>

namespace marrow::cli {
namespace {

using nlohmann::json;

std::string text(double value) { return formatted("%.4g", value); }

json of(const TuningPoint& point) {
  json result{{"values", point.values}, {"figure", point.figure}, {"runs", point.runs}, {"failed", point.failed}};
  if (!point.refused.empty()) result["refused"] = point.refused;
  return result;
}

}  // namespace

bool Tuning::is_better() const {
  return higher_is_better ? points[best].figure > untuned.figure : points[best].figure < untuned.figure;
}

std::string values_text(const compare::TuneRule& rule, const std::vector<double>& values) {
  std::string result;
  for (std::size_t o = 0; o < values.size(); ++o)
    result += (o ? ", " : "") + rule.options[o].key + " " + text(values[o]);
  return result;
}

std::string sentence(const Tuning& tuning) {
  const std::string unit = tuning.unit.empty() ? "" : " " + tuning.unit;
  const TuningPoint& best = tuning.points[tuning.best];
  return "tuned on " + std::to_string(tuning.rule.training_cases) + " cases by " + tuning.rule.optimizer + ", " +
         std::to_string(tuning.points.size()) + " points: mean " + tuning.figure + " " + text(tuning.untuned.figure) +
         unit + " for " + tuning.variant + ", " + text(best.figure) + unit + " at " +
         values_text(tuning.rule, best.values) + (tuning.is_better() ? "" : ", which is no better");
}

json tuning_json(const Tuning& tuning) {
  json options = json::array(), points = json::array();
  for (const compare::SweptOption& option : tuning.rule.options)
    options.push_back({{"option", option.key}, {"range", option.range}, {"scale", option.is_log ? "log" : "linear"}});
  for (const TuningPoint& point : tuning.points) points.push_back(of(point));
  return {{"options", options},
          {"variant", tuning.variant},
          {"figure", tuning.figure},
          {"unit", tuning.unit},
          {"failed_as", tuning.rule.failed_as},
          {"higher_is_better", tuning.higher_is_better},
          {"optimizer", tuning.rule.optimizer},
          {"stopped_because", tuning.stopped_because},
          {"training_cases", tuning.rule.training_cases},
          {"untuned", of(tuning.untuned)},
          {"points", points},
          {"best", tuning.best},
          {"sentence", sentence(tuning)}};
}

}  // namespace marrow::cli
