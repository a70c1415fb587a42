// SPDX-License-Identifier: Apache-2.0
// Which variants differ, how they rank, and what factors do, for comparison.json.
#include <cmath>
#include <nlohmann/json.hpp>

#include "compare/comparison.hpp"

namespace marrow::cli {
namespace {

using compare::Experiment;
using nlohmann::json;

/// Who lost more runs, "variant" or the word for the other one; null if the median is a number.
json who_fails_more(const compare::Comparison& comparison, bool higher_is_better, const std::string& other) {
  if (!comparison.compared() || std::isfinite(comparison.median_difference)) return {};
  return (comparison.median_difference > 0) != higher_is_better ? "variant" : other;
}

/// Whether a sentence about the comparison gives its interval: not with too few cases, nor between two failures.
bool has_interval(const compare::Comparison& comparison) {
  const compare::Interval& interval = comparison.interval;
  return comparison.compared() >= compare::fewest_cases(1 - interval.confidence) &&
         (std::isfinite(interval.lower) || std::isfinite(interval.upper) || interval.lower < interval.upper);
}

/// The numbers of a comparison, without p. `other` is the word for the one that the variant is compared with.
json numbers_of(const compare::Comparison& comparison, bool higher_is_better, const std::string& other) {
  const bool is_baseline = other == "baseline";
  return {{"cases", comparison.compared()},
          {"of_cases", comparison.cases.all()},
          {"cases_variant_lost", comparison.cases.variant_lost},
          {is_baseline ? "cases_baseline_lost" : "cases_reference_lost", comparison.cases.reference_lost},
          {"runs", comparison.runs.all()},
          {"pairs", comparison.runs.both},
          {"runs_variant_lost", comparison.runs.variant_lost},
          {is_baseline ? "runs_baseline_lost" : "runs_reference_lost", comparison.runs.reference_lost},
          {"runs_both_lost", comparison.runs.neither},
          {"difference", comparison.compared() ? bound_json(comparison.median_difference) : json()},
          {"fails_more", who_fails_more(comparison, higher_is_better, other)},
          {"difference_of_pairs", comparison.median_of_both ? json(*comparison.median_of_both) : json()},
          {"has_interval", has_interval(comparison)},
          {"low", bound_json(comparison.interval.lower)},
          {"high", bound_json(comparison.interval.upper)}};
}

json of(const Finding& finding, const Experiment& experiment, const Answer& answer, const std::string& other) {
  const compare::MetricChoice& metric = experiment.metrics[finding.metric];
  json result = numbers_of(finding.comparison, metric.higher_is_better(), other);
  result.update({{"variant", experiment.variants[finding.variant].name},
                 {"metric", metric.path},
                 {"unit", answer.units[finding.metric]},
                 {"p", finding.comparison.test.p},
                 {"p_holm", finding.p_holm},
                 {"is_shown", compare::difference_shown(finding.comparison, finding.p_holm)},
                 {"sentence", finding.sentence}});
  return result;
}

json names_of(const Experiment& experiment, const std::vector<std::size_t>& variants) {
  json names = json::array();
  for (const std::size_t variant : variants) names.push_back(experiment.variants[variant].name);
  return names;
}

json ranking_json(const Experiment& experiment, const Answer& answer, std::size_t m) {
  const Ranking& ranking = answer.rankings[m];
  json places = json::array();
  for (const Ranking::Place& place : ranking.places)
    places.push_back({{"variant", experiment.variants[place.variant].name},
                      {"rank", place.rank},
                      {"median", bound_json(place.median)},
                      {"lost", place.lost},
                      {"group", place.group.empty() ? json() : json(place.group)}});
  return {{"metric", experiment.metrics[m].path},
          {"unit", answer.units[m]},
          {"places", places},
          {"pairs", ranking.pairs},
          {"different", ranking.different},
          {"like_best", names_of(experiment, ranking.like_best)},
          {"better_than_best", names_of(experiment, ranking.better_than_best)},
          {"sentence", ranking_sentence(experiment, answer, m)}};
}

json of(const Effect& effect, const Experiment& experiment, const Answer& answer) {
  const compare::MetricChoice& metric = experiment.metrics[effect.metric];
  const compare::Factor& factor = experiment.factors[effect.factor];
  json result = numbers_of(effect.comparison, metric.higher_is_better(), "reference");
  result.update({{"factor", factor.name},
                 {"variant", factor.levels[effect.level]},
                 {"reference", factor.levels.front()},
                 {"metric", metric.path},
                 {"unit", answer.units[effect.metric]},
                 {"sentence", effect.sentence}});
  return result;
}

}  // namespace

json bound_json(double value) { return std::isfinite(value) ? json(value) : json(); }

json findings_json(const Experiment& experiment, const Answer& answer) {
  json result = {{"comparisons", json::array()}};
  for (const Finding& finding : answer.findings)
    result["comparisons"].push_back(of(finding, experiment, answer, "baseline"));
  for (const PairFinding& pair : answer.pairs) {
    json one = of(pair.finding, experiment, answer, "reference");
    one["reference"] = experiment.variants[pair.reference].name;
    result["all_pairs"].push_back(std::move(one));
  }
  for (std::size_t m = 0; m < answer.rankings.size(); ++m)
    result["rankings"].push_back(ranking_json(experiment, answer, m));
  for (const Effect& effect : answer.effects) result["effects"].push_back(of(effect, experiment, answer));
  return result;
}

}  // namespace marrow::cli
