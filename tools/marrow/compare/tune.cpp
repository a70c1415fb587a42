// SPDX-License-Identifier: Apache-2.0
// Chooses numbers of options by an optimizer on the training cases. Then compares on the cases that are held out.
#include <cstdio>
#include <map>

#include "compare/comparison.hpp"
#include "compare/figure_units.hpp"
#include "compare/unchanged.hpp"
#include "marrow/base/error.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/base/printable.hpp"
#include "marrow/domain/functions.hpp"
#include "marrow/runtime/node/types.hpp"
#include "marrow/runtime/pipeline/one_node.hpp"
#include "marrow/runtime/run/executor.hpp"

namespace marrow::cli {
namespace {

using compare::CellRow;
using compare::Experiment;
using compare::MetricChoice;

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
