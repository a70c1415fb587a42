// SPDX-License-Identifier: Apache-2.0
// Writes cells.csv and cells.jsonl (one row per cell), poses.csv and poses.jsonl (one per pose), and comparison.json
// (the complete answer).
//
// Which variants differ, how they rank, and what factors do, for comparison.json.
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <set>

#include "compare/comparison.hpp"
#include "compare/text_table.hpp"
#include "marrow/base/json_text.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/base/text_file.hpp"

namespace marrow::cli {
namespace {

using compare::CellPose;
using compare::CellRow;
using compare::Experiment;
using nlohmann::json;

/// Null for a bound that is not finite.
json bound_json(double value) { return std::isfinite(value) ? json(value) : json(); }

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

/// The keys "comparisons", and where there are any "all_pairs", "rankings" and "effects".
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

constexpr std::array kRotations{"frontal", "lateral", "axial"};

constexpr std::array kTranslations{"along_frontal", "along_lateral", "along"};

/// Seeds of the cases that have one, by the case's name.
std::map<std::string, std::uint64_t> seeds_of(const Experiment& experiment) {
  std::map<std::string, std::uint64_t> seeds;
  for (const compare::ExperimentCase& one : experiment.cases)
    if (one.is_simulated || one.folder.empty()) seeds[one.name] = one.seed;
  return seeds;
}

std::string head() {
  std::string text = "cell,case,variant,start,seed,output,item,target,source";
  for (const char row : {'1', '2', '3'})
    for (const char* end : {"1", "2", "3", "4_mm"}) text += std::string(",m") + row + end;
  text += ",verdict,failure_probability,axes";
  for (const char* axis : kRotations) text += std::string(",predicted_") + axis + "_deg";
  for (const char* axis : kTranslations) text += std::string(",predicted_") + axis + "_mm";
  return text + "\n";
}

const char* axes_of(const CellPose& pose) {
  return pose.deviations.empty() ? "" : pose.has_bone_axes ? "bone" : "model";
}

/// A line for each pose that a cell found: whose it is, its matrix, its verdict and its predicted deviations.
std::string poses_csv(const Experiment& experiment, const std::vector<CellRow>& rows) {
  const auto seeds = seeds_of(experiment);
  std::string text = head();
  for (const CellRow& row : rows)
    for (const CellPose& pose : row.poses) {
      const auto seed = seeds.find(row.case_name);
      text += csv_field(row.id) + "," + csv_field(row.case_name) + "," + csv_field(row.variant) + "," +
              csv_field(row.start) + "," + (seed == seeds.end() ? "" : formatted("{}", seed->second));
      for (const std::string& name : {pose.output, pose.item, pose.target, pose.source}) text += "," + csv_field(name);
      for (const double number : pose.matrix) text += "," + exact_number(number);
      text += formatted(",{},{},{}", pose.verdict ? name_of(*pose.verdict) : "", csv_number(pose.failure_probability),
                        axes_of(pose));
      for (std::size_t i = 0; i < 6; ++i)
        text += "," + (i < pose.deviations.size() ? csv_number(pose.deviations[i]) : std::string());
      text += "\n";
    }
  return text;
}

std::string poses_jsonl(const Experiment& experiment, const std::vector<CellRow>& rows) {
  const auto seeds = seeds_of(experiment);
  const auto of = [](const std::optional<double>& value) { return value ? json(*value) : json(); };
  std::string text;
  for (const CellRow& row : rows)
    for (const CellPose& pose : row.poses) {
      const auto seed = seeds.find(row.case_name);
      json matrix = json::array(), predicted;
      for (std::size_t r = 0; r < 3; ++r)
        matrix.push_back(std::vector<double>(pose.matrix.begin() + std::ptrdiff_t(4 * r),
                                             pose.matrix.begin() + std::ptrdiff_t(4 * r + 4)));
      matrix.push_back({0, 0, 0, 1});
      for (std::size_t i = 0; i < pose.deviations.size(); ++i)
        predicted[i < 3 ? "rotation_deg" : "translation_mm"].push_back(of(pose.deviations[i]));
      if (!predicted.is_null()) predicted["axes"] = axes_of(pose);
      text += json_text({{"cell", row.id},
                         {"case", row.case_name},
                         {"variant", row.variant},
                         {"start", row.start},
                         {"seed", seed == seeds.end() ? json() : json(seed->second)},
                         {"output", pose.output},
                         {"item", pose.item},
                         {"target", pose.target},
                         {"source", pose.source},
                         {"matrix", matrix},
                         {"verdict", pose.verdict ? json(name_of(*pose.verdict)) : json()},
                         {"failure_probability", of(pose.failure_probability)},
                         {"predicted_deviation", predicted}}) +
              "\n";
    }
  return text;
}

/// The options that any variant changes.
std::vector<std::string> changed_options(const Experiment& experiment) {
  std::set<std::string> keys;
  for (const compare::Variant& variant : experiment.variants)
    for (const Override& one : variant.overrides) keys.insert(one.key);
  return {keys.begin(), keys.end()};
}

/// The values of these options by the variant's name; empty for an option that the variant does not change.
std::map<std::string, std::vector<std::string>> options_by_variant(const Experiment& experiment,
                                                                   const std::vector<std::string>& options) {
  std::map<std::string, std::vector<std::string>> values;
  for (const compare::Variant& variant : experiment.variants) {
    std::map<std::string, std::string> own;
    for (const Override& change : variant.overrides) own[change.key] = change.value;
    std::vector<std::string>& of_variant = values[variant.name];
    for (const std::string& option : options) of_variant.push_back(own[option]);
  }
  return values;
}

std::string csv(const Experiment& experiment, const std::vector<CellRow>& rows) {
  const std::vector<std::string> options = changed_options(experiment);
  const auto values_of = options_by_variant(experiment, options);
  std::string text = "cell,variant,case,start,status,reason,success,tries,verdict,failure_probability";
  for (const std::string& option : options) text += "," + csv_field(option);
  for (const compare::MetricChoice& metric : experiment.metrics) text += "," + csv_field(metric.path);
  text += ",initial_error,seconds,evaluations,key\n";
  for (const CellRow& row : rows) {
    text +=
        formatted("{},{},{},{},{},{},{},{},{},{}", csv_field(row.id), csv_field(row.variant), csv_field(row.case_name),
                  csv_field(row.start), row.failed.empty() ? "done" : "failed", csv_field(row.failed + row.absent),
                  !experiment.defines_success() ? ""
                  : row.is_success(experiment)  ? "1"
                                                : "0",
                  row.tries, row.verdict ? name_of(*row.verdict) : "", csv_number(row.failure_probability));
    for (const std::string& value : values_of.at(row.variant)) text += "," + csv_field(value);
    for (const auto& value : row.values) text += "," + csv_number(value);
    text +=
        formatted(",{},{},{},{}\n", csv_number(row.initial_error), csv_number(row.seconds), row.evaluations, row.key);
  }
  return text;
}

std::string jsonl(const Experiment& experiment, const std::vector<CellRow>& rows) {
  const std::vector<std::string> options = changed_options(experiment);
  const auto values_of = options_by_variant(experiment, options);
  std::string text;
  for (const CellRow& row : rows) {
    json j = json::parse(compare::to_json(row));
    j.erase("digest");  // of a row without what is added here
    j.erase("poses");   // they have a file of their own
    j["success"] = experiment.defines_success() ? json(row.is_success(experiment)) : json();
    j["options"] = json::object();
    for (std::size_t i = 0; i < options.size(); ++i) j["options"][options[i]] = values_of.at(row.variant)[i];
    for (std::size_t i = 0; i < experiment.metrics.size(); ++i)
      j[experiment.metrics[i].path] = row.values[i] ? json(*row.values[i]) : json();
    text += json_text(j) + "\n";
  }
  return text;
}

json of(const VariantFigure& figure, bool higher_is_better = false) {
  json result{{"count", figure.count}, {"of", figure.of}};
  if (!figure.count) return result;
  result.update({{"median", figure.summary.median},
                 {"q1", figure.summary.lower_quartile},
                 {"q3", figure.summary.upper_quartile},
                 {higher_is_better ? "p5" : "p95", figure.summary.percentile_95},
                 {"worst", figure.summary.worst},
                 {"mean", figure.summary.mean}});
  if (figure.median) result.update({{"median_low", figure.median->lower}, {"median_high", figure.median->upper}});
  return result;
}

/// A rate of nothing has no bounds.
json of(std::size_t count, std::size_t total, const compare::Interval& rate) {
  json result{{"count", count}, {"of", total}, {"rate", nullptr}, {"low", nullptr}, {"high", nullptr}};
  if (total) result.update({{"rate", double(count) / double(total)}, {"low", rate.lower}, {"high", rate.upper}});
  return result;
}

json of(const std::optional<compare::CaseRate>& success) {
  if (!success || !success->runs()) return {};
  json result = of(success->successes(), success->runs(), success->interval());
  result["effective_runs"] = success->effective_runs();
  return result;
}

json of(const VerdictCounts& counts, bool has_success) {
  json result{{"cells", counts.cells}, {"silent_failures", nullptr}, {"caught", nullptr}, {"false_alarms", nullptr}};
  if (has_success)
    result.update({{"silent_failures", of(counts.silent, counts.misses, counts.silent_rate)},
                   {"caught", counts.caught()},
                   {"false_alarms", of(counts.false_alarms, counts.successes, counts.false_alarm_rate)}});
  return result;
}

json of(const std::optional<compare::CaptureRange>& capture, std::size_t unknown_starts) {
  if (!capture) return {};
  json bins = json::array();
  for (const compare::CaptureRange::Bin& bin : capture->bins) {
    bins.push_back(of(bin.successes, bin.runs, bin.success));
    bins.back().update({{"from", bin.from}, {"to", bin.to}});
  }
  return {{"range", capture->bins.empty() ? json() : json(capture->range)},
          {"is_open", capture->is_open},
          {"unknown_starts", unknown_starts},
          {"bins", bins}};
}

json metrics_of(const Experiment& experiment, const Answer& answer) {
  json metrics = json::array();
  for (std::size_t m = 0; m < experiment.metrics.size(); ++m) {
    const compare::MetricChoice& metric = experiment.metrics[m];
    metrics.push_back(
        {{"name", metric.path},
         {"label", metric.label},
         {"unit", answer.units[m]},
         {metric.higher_is_better() ? "success_above" : "success_below", metric.limit ? json(*metric.limit) : json()},
         {"higher_is_better", metric.higher_is_better()},
         {"same_runs", bool(answer.same_runs[m])}});
  }
  return metrics;
}

json of(const compare::StopRule& rule, const compare::Look& look, const Experiment& experiment,
        const std::string& sentence) {
  json result{{"look", look.number},
              {"looks", look.looks},
              {"cases", look.cases},
              {"most_cases", rule.most_cases},
              {"is_met", look.is_met},
              {"figure", rule.metric ? experiment.metrics[*rule.metric].path : "success"},
              {"variant", experiment.variants[look.variant].name},
              {"level", look.level},
              {"low", bound_json(look.interval.lower)},
              {"high", bound_json(look.interval.upper)},
              {"sentence", sentence}};
  if (rule.goal == compare::StopRule::Goal::difference)
    result.update({{"p", look.p}, {"difference", bound_json(look.difference)}, {"alpha", rule.alpha}});
  else
    result["width"] = rule.width;
  return result;
}

}  // namespace

json answer_json(const Experiment& experiment, const Answer& answer) {
  json variants = json::array();
  for (std::size_t v = 0; v < answer.variants.size(); ++v) {
    const VariantSummary& summary = answer.variants[v];
    json figures = json::object();
    for (std::size_t m = 0; m < experiment.metrics.size(); ++m)
      figures[experiment.metrics[m].path] = of(summary.figures[m], experiment.metrics[m].higher_is_better());
    variants.push_back({{"name", experiment.variants[v].name},
                        {"is_baseline", v == experiment.baseline},
                        {"runs", summary.runs},
                        {"failed", summary.failed},
                        {"incomplete", summary.incomplete},
                        {"success", of(summary.success)},
                        {"metrics", figures},
                        {"seconds", of(summary.seconds)},
                        {"evaluations", of(summary.evaluations)}});
    if (summary.verdicts.cells) variants.back()["verdicts"] = of(summary.verdicts, experiment.defines_success());
    if (!experiment.initial_error.empty()) variants.back()["capture"] = of(summary.capture, summary.unknown_starts);
  }
  json result{{"experiment", experiment.name}, {"metrics", metrics_of(experiment, answer)}, {"variants", variants}};
  result.update(findings_json(experiment, answer));
  if (!experiment.initial_error.empty())
    result["initial_error"] = {{"name", experiment.initial_error}, {"unit", answer.initial_error_unit}};
  if (!answer.curves.empty()) result["curves"] = curves_json(experiment, answer.curves);
  result["times"] = answer.times;
  if (answer.tuning) {
    result["tuning"] = tuning_json(*answer.tuning);
    result["curves"] = json::parse(answer.tuning->curves);
  }
  if (answer.look) result["stop"] = of(*experiment.stop, *answer.look, experiment, answer.look_sentence);
  return result;
}

void write_tables(const Experiment& experiment, const std::vector<CellRow>& rows, const Answer& answer,
                  const std::filesystem::path& folder) {
  write_text_file(folder / "cells.csv", csv(experiment, rows));
  write_text_file(folder / "cells.jsonl", jsonl(experiment, rows));
  write_text_file(folder / "poses.csv", poses_csv(experiment, rows));
  write_text_file(folder / "poses.jsonl", poses_jsonl(experiment, rows));
  write_text_file(folder / "comparison.json", json_text(answer_json(experiment, answer), 1) + "\n");
}

// The poses of all cells: poses.csv and poses.jsonl.

}  // namespace marrow::cli
