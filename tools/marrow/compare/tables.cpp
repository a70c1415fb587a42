// SPDX-License-Identifier: Apache-2.0
// Writes cells.csv and cells.jsonl (one row per cell), poses.csv and poses.jsonl (one per pose), and comparison.json
// (the complete answer).
#include <cmath>
#include <nlohmann/json.hpp>
#include <set>

#include "compare/comparison.hpp"
#include "compare/csv.hpp"
#include "marrow/base/json_text.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/base/text_file.hpp"

namespace marrow::cli {
namespace {

using compare::CellRow;
using compare::Experiment;
using nlohmann::json;

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

}  // namespace marrow::cli
