// SPDX-License-Identifier: Apache-2.0
// Comparisons in several rounds. Tuning chooses numbers of options by an optimizer on the training cases. Then compares
// on the cases that are held out.
#include <algorithm>
#include <cstdio>
#include <map>
#include <nlohmann/json.hpp>

#include "compare/cell_jobs.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/base/printable.hpp"
#include "marrow/runtime/node/types.hpp"

namespace marrow::cli {
namespace {

using compare::CellRow;
using compare::Experiment;
using compare::MetricChoice;
using nlohmann::json;

/// The numbers of cases to look at, up to those that were asked for.
std::vector<std::size_t> looks_within(const CompareRequest& request, const Experiment& experiment) {
  if (!experiment.stop)
    throw Error(experiment.file.string() + " does not say when to stop adding cases; add for example  stop: {figure: " +
                experiment.metrics[0].path + ", width: 0.05, most_cases: 300, look_every: 20}");
  const compare::StopRule& rule = *experiment.stop;
  if (request.more_cases < rule.look_every && rule.first_cases < rule.most_cases)
    throw Error(formatted("--more-cases {} is less than the {} cases from one look to the next; give at least as many",
                          request.more_cases, rule.look_every));
  std::vector<std::size_t> looks = rule.looks();
  while (looks.back() > rule.first_cases + request.more_cases) looks.pop_back();
  return looks;
}

/// The experiment with so many further cases. It was read without faults before.
Experiment with_more(const Experiment& experiment, const Catalogue& catalogue, std::size_t more) {
  Diagnostics diagnostics;
  Experiment larger = compare::read_experiment(experiment.file, catalogue, diagnostics, more);
  if (!diagnostics.empty())
    throw Error(formatted("the experiment cannot have {} more cases:\n{}", more, diagnostics.text()));
  return larger;
}

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

/// "edges.high 72.3, edges.low 40".
std::string values_text(const compare::TuneRule& rule, const std::vector<double>& values) {
  std::string result;
  for (std::size_t o = 0; o < values.size(); ++o)
    result += formatted("{}{} {:.4g}", o ? ", " : "", rule.options[o].key, values[o]);
  return result;
}

/// What a score is: "mean mTRE with failed and worse runs counted as 20 mm".
std::string score_rule(const Tuning& tuning) {
  return formatted("mean {} with failed and worse runs counted as {}", tuning.figure,
                   text(tuning, tuning.rule.failed_as));
}

/// "0.41 mm (mean 0.41 mm of 20 runs)".
std::string score_text(const Tuning& tuning, const TuningPoint& point) {
  return text(tuning, point.score) + " (" + runs_text(tuning, point) + ")";
}

constexpr double kFirstStep = 0.25, kStepTolerance = 0.02;  // fractions of the options' ranges

struct Interrupted : std::exception {};

/// The options' present values as fractions of their ranges; the middle where that is unknown.
Eigen::VectorXd fractions_now(const Experiment& experiment, const Catalogue& catalogue) {
  const compare::TuneRule& rule = *experiment.tune;
  Diagnostics faults;
  const Pipeline pipeline = read_pipeline(experiment.pipeline, arguments_of(experiment, {rule.variant, 0, 0}, "case"),
                                          catalogue, faults, true);
  Eigen::VectorXd fractions = Eigen::VectorXd::Constant(Eigen::Index(rule.options.size()), 0.5);
  for (std::size_t o = 0; o < rule.options.size(); ++o)
    for (const PipelineNode& node : pipeline.nodes)
      for (std::size_t i = 0; i < node.info.options.size(); ++i) {
        if (node.id + "." + node.info.options[i].name != rule.options[o].key) continue;
        if (const auto* number = std::get_if<double>(&node.options[i]))
          fractions[Eigen::Index(o)] = rule.options[o].fraction_of(*number);
        if (const auto* whole = std::get_if<std::int64_t>(&node.options[i]))
          fractions[Eigen::Index(o)] = rule.options[o].fraction_of(double(*whole));
      }
  return fractions;
}

class Tuner {
 public:
  Tuner(const CompareRequest& request, const Catalogue& catalogue, const Experiment& experiment,
        const std::filesystem::path& folder)
      : request_(request),
        catalogue_(catalogue),
        experiment_(experiment),
        rule_(*experiment.tune),
        folder_(folder),
        units_(experiment) {
    request_.quiet = true;  // a line for each point says enough
    const MetricChoice& metric = experiment.metrics[rule_.metric];
    made_.rule = rule_;
    made_.figure = metric.label;
    made_.higher_is_better = metric.higher_is_better();
    made_.variant = experiment.variants[rule_.variant].name;
    tried_ = experiment;
    tried_.variants.clear();
    tried_.swept = rule_.options;
    is_quiet_ = request.quiet;
  }

  Tuning run() {
    Experiment untuned = experiment_;
    untuned.variants = {experiment_.variants[rule_.variant]};
    made_.untuned = point_of(untuned, {});
    say("score: " + score_rule(made_));
    say(made_.variant + " as it is: " + score_text(made_, made_.untuned));
    MinimisationProblem problem;
    problem.function = [&](const Eigen::VectorXd& x) { return badness_at({x.data(), x.data() + x.size()}); };
    problem.start = fractions_now(experiment_, catalogue_);
    problem.initial_step = Eigen::VectorXd::Constant(problem.start.size(), kFirstStep);
    problem.lower = Eigen::VectorXd::Zero(problem.start.size());
    problem.upper = Eigen::VectorXd::Ones(problem.start.size());
    problem.max_evaluations = int(rule_.points);
    problem.step_tolerance = kStepTolerance / kFirstStep;
    made_.stopped_because = optimizer().minimise(problem).stopped_because;
    made_.curves = curves_json(tried_, curves_of(tried_, rows_by_variant(tried_, rows_))).dump();
    return made_;
  }

  /// The dependencies of the cells of all points, each as the first cell found it.
  const compare::Dependencies& dependencies() const { return dependencies_; }

 private:
  const Optimizer& optimizer() {
    Diagnostics faults;
    node_ = pipeline_of_node(rule_.optimizer, {}, rule_.optimizer_options, catalogue_, faults);  // it was checked
    RunSettings settings;
    settings.threads = 1;
    result_ = run_pipeline(node_.pipeline, catalogue_, settings);
    value_ = value_of(result_, node_.pipeline.outputs.at(0).source);
    if (value_.is_absent()) throw Error(rule_.optimizer + ": " + value_.missing);
    return value_.as<Optimizer>();
  }

  double sign() const { return made_.higher_is_better ? -1 : 1; }

  double badness_at(const std::vector<double>& fractions) {
    const std::vector<double> values = rule_.values_at(fractions);
    if (const auto known = known_.find(values); known != known_.end())
      return sign() * made_.points[known->second].score;
    Experiment at_point = experiment_;
    request_.tuned = add_tuned(at_point, values);
    at_point.variants = {at_point.variants.back()};
    if (const std::string fault = fault_of(at_point); fault.empty()) {
      tried_.variants.push_back(at_point.variants[0]);
      made_.add(point_of(at_point, values));
    } else {
      made_.add({values, rule_.failed_as, std::nullopt, 0, 0, 0, fault});
    }
    known_[values] = made_.points.size() - 1;
    const TuningPoint& point = made_.points.back();
    say(formatted("point {} of at most {}, {}: score {}{}", made_.points.size(), rule_.points,
                  values_text(rule_, values), score_text(made_, point),
                  made_.best ? "; best so far " + score_text(made_, made_.points[*made_.best]) : ""));
    return sign() * point.score;
  }

  void say(const std::string& text) const {
    if (!is_quiet_) std::fprintf(stderr, "marrow: %s\n", printable(text).c_str());
  }

  /// Why the pipeline refuses the values of the only variant; empty if it does not. Values that are good alone may not
  /// fit together, such as a lower threshold above the upper one.
  std::string fault_of(const Experiment& at_point) const {
    Diagnostics faults;
    read_pipeline(at_point.pipeline, arguments_of(at_point, {0, 0, 0}, "case"), catalogue_, faults, true);
    return faults.empty() ? "" : faults.sorted()[0].message;
  }

  /// Runs the only variant of an experiment on the training cases.
  TuningPoint point_of(Experiment experiment, const std::vector<double>& values) {
    experiment.baseline = 0;
    keep_training_cases(experiment);
    const auto cells = run_cells(request_, catalogue_, experiment, folder_);
    if (!cells) throw Interrupted();
    dependencies_.contents.insert(cells->dependencies.contents.begin(), cells->dependencies.contents.end());
    dependencies_.builds.insert(cells->dependencies.builds.begin(), cells->dependencies.builds.end());
    units_.add(cells->rows);
    made_.unit = units_.of_metrics()[rule_.metric];
    if (!values.empty()) rows_.insert(rows_.end(), cells->rows.begin(), cells->rows.end());
    return cli::point_of(experiment_, values, cells->rows);
  }

  CompareRequest request_;
  const Catalogue& catalogue_;
  const Experiment& experiment_;
  const compare::TuneRule& rule_;
  std::filesystem::path folder_;
  bool is_quiet_ = false;
  OneNode node_;
  RunResult result_;
  Value value_;
  Tuning made_;
  std::map<std::vector<double>, std::size_t> known_;
  Experiment tried_;
  std::vector<CellRow> rows_;  ///< of all points
  FigureUnits units_;
  compare::Dependencies dependencies_;
};

}  // namespace

Experiment largest_experiment(const CompareRequest& request, const Catalogue& catalogue, const Experiment& experiment) {
  return with_more(experiment, catalogue, looks_within(request, experiment).back() - experiment.stop->first_cases);
}

int run_more_cases(const CompareRequest& asked, const Catalogue& catalogue, const Experiment& experiment,
                   const std::filesystem::path& folder) {
  CompareRequest request = asked;
  const std::vector<std::size_t> looks = looks_within(asked, experiment);
  for (std::size_t k = 0;; ++k) {
    request.more_cases = looks[k] - experiment.stop->first_cases;
    const Experiment larger = with_more(experiment, catalogue, request.more_cases);
    if (k + 1 == looks.size()) return run_comparison(request, catalogue, larger, folder);
    const auto cells = run_cells(request, catalogue, larger, folder);
    if (!cells) return stopped();
    const Answer answer = answer_of(larger, cells->rows);
    request.made_before += cells->made;
    request.calls_before.add(cells->calls);
    for (const compare::CellRow& row : cells->rows)
      if (!row.failed.empty()) request.failed_before.emplace(row.id, row);
    if (answer.look->is_met) return run_comparison(request, catalogue, larger, folder);
    if (!request.quiet) std::fprintf(stderr, "marrow: %s\n", printable(answer.look_sentence).c_str());
  }
}

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

// Adds cases to a comparison until its rule says stop.

int run_tuning(const CompareRequest& asked, const Catalogue& catalogue, const Experiment& experiment,
               const std::filesystem::path& folder) {
  CompareRequest request = asked;
  const Unchanged unchanged(experiment, Unchanged::Cases::all);
  Tuner tuner(asked, catalogue, experiment, folder);
  try {
    request.tuning = tuner.run();
  } catch (const Interrupted&) {
    return stopped();
  }
  if (!request.quiet) std::fprintf(stderr, "marrow: %s\n", printable(sentence(*request.tuning)).c_str());
  Experiment held_out = experiment;
  if (const auto best = request.tuning->best) request.tuned = add_tuned(held_out, request.tuning->points[*best].values);
  keep_held_out_cases(held_out);
  const int code = run_comparison(request, catalogue, held_out, folder);
  unchanged.check(tuner.dependencies());
  return code;
}

}  // namespace marrow::cli
