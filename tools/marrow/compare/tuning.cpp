// SPDX-License-Identifier: Apache-2.0
#include "compare/tuning.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "marrow/base/number_text.hpp"

namespace marrow::cli {
namespace {

using nlohmann::json;

std::string text(double value) { return formatted("{:.4g}", value); }
std::string text(const Tuning& tuning, double value) {
  return text(value) + (tuning.unit.empty() ? "" : " " + tuning.unit);
}

json of(const TuningPoint& point) {
  json result{{"values", point.values}, {"score", point.score},   {"mean", point.mean ? json(*point.mean) : json()},
              {"runs", point.runs},     {"failed", point.failed}, {"capped", point.capped}};
  if (!point.refused.empty()) result["refused"] = point.refused;
  return result;
}

std::string runs_text(const Tuning& tuning, const TuningPoint& point) {
  if (!point.refused.empty()) return "refused by the pipeline";
  if (!point.mean) return formatted("no figure in any of {} runs", point.runs);
  std::string result = formatted("mean {} of {}{} runs", text(tuning, *point.mean),
                                 point.failed ? formatted("{} of ", point.runs - point.failed) : "", point.runs);
  if (point.failed) result += formatted(", {} failed or without the figure", point.failed);
  if (point.capped) result += formatted(", {} worse than {}", point.capped, text(tuning, tuning.rule.failed_as));
  return result;
}

std::string refused_text(const Tuning& tuning) {
  const auto refused = std::count_if(tuning.points.begin(), tuning.points.end(),
                                     [](const auto& point) { return !point.refused.empty(); });
  return refused ? formatted(", {} of them refused by the pipeline", std::size_t(refused)) : "";
}

}  // namespace

TuningPoint point_of(const compare::Experiment& experiment, const std::vector<double>& values,
                     const std::vector<compare::CellRow>& rows) {
  const compare::TuneRule& rule = *experiment.tune;
  const bool higher = experiment.metrics[rule.metric].higher_is_better();
  TuningPoint point{values, rule.failed_as, std::nullopt, rows.size()};
  double sum = 0;
  for (const compare::CellRow& row : rows) {
    const std::optional<double> figure = row.failed.empty() ? row.values[rule.metric] : std::nullopt;
    const bool is_worse = figure && (higher ? *figure < rule.failed_as : *figure > rule.failed_as);
    point.failed += !figure;
    point.capped += is_worse;
    // By its distance, so that the score is exactly failed_as if no run is better.
    if (figure && !is_worse) point.score += (*figure - rule.failed_as) / double(rows.size());
    sum += figure.value_or(0);
  }
  if (point.failed < point.runs) point.mean = sum / double(point.runs - point.failed);
  return point;
}

void Tuning::add(TuningPoint point) {
  const bool is_found = point.mean && is_better_score(point.score, rule.failed_as);
  if (is_found && (!best || is_better_score(point.score, points[*best].score))) best = points.size();
  points.push_back(std::move(point));
}

bool Tuning::is_better() const { return best && is_better_score(points[*best].score, untuned.score); }

std::string values_text(const compare::TuneRule& rule, const std::vector<double>& values) {
  std::string result;
  for (std::size_t o = 0; o < values.size(); ++o)
    result += formatted("{}{} {:.4g}", o ? ", " : "", rule.options[o].key, values[o]);
  return result;
}

std::string score_rule(const Tuning& tuning) {
  return formatted("mean {} with failed and worse runs counted as {}", tuning.figure,
                   text(tuning, tuning.rule.failed_as));
}

std::string score_text(const Tuning& tuning, const TuningPoint& point) {
  return text(tuning, point.score) + " (" + runs_text(tuning, point) + ")";
}

std::string sentence(const Tuning& tuning) {
  const std::string start =
      formatted("tuned on {} cases by {}, {} points{}; score: {}; {}: {}; ", tuning.rule.training_cases,
                tuning.rule.optimizer, tuning.points.size(), refused_text(tuning), score_rule(tuning), tuning.variant,
                score_text(tuning, tuning.untuned));
  if (!tuning.best)
    return start + "no point is better than failed runs, so none is compared on the cases that are held out";
  const TuningPoint& best = tuning.points[*tuning.best];
  return start + values_text(tuning.rule, best.values) + ": " + score_text(tuning, best) +
         (tuning.is_better() ? "" : ", which is no better");
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
          {"score_rule", score_rule(tuning)},
          {"untuned", of(tuning.untuned)},
          {"points", points},
          {"best", tuning.best ? json(*tuning.best) : json()},
          {"sentence", sentence(tuning)}};
}

}  // namespace marrow::cli
