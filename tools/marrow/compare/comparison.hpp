// SPDX-License-Identifier: Apache-2.0
#pragma once
// The commands that compare variants.
#include <filesystem>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "marrow/compare/bootstrap.hpp"
#include "marrow/compare/case_rate.hpp"
#include "marrow/compare/cell.hpp"

namespace CLI {
class App;
}

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

/// "tuned on 20 cases by NODE, 31 points; score: SCORE_RULE; canny: 0.41 mm (mean 0.41 mm of 20 runs); edges.high 72.3:
/// 0.23 mm (mean 0.23 mm of 20 runs)".
std::string sentence(const Tuning& tuning);
nlohmann::json tuning_json(const Tuning& tuning);

/// Calls of nodes in the cells that a command ran, without cells that were done before.
struct CallCounts {
  long made = 0, cached = 0;
  void add(const compare::CellRow& row);
  void add(const CallCounts& others);
};

/// A difference of which a dry run says how many cases it takes.
struct WantedDifference {
  std::string figure;  ///< a metric's path; empty for the first one
  double amount = 0;   ///< in the figure's unit
};

struct CompareRequest {
  std::filesystem::path file;
  std::vector<std::string> inputs = {};  ///< name=value, for the pipeline's inputs
  std::filesystem::path folder;          ///< empty = runs/compare/NAME
  int jobs = 0;                          ///< number of cells at once; 0 = the machine's cores / threads
  int threads = 1;                       ///< threads of each cell
  double time_limit_s = 600;
  double memory_limit_mb = 4000;
  std::size_t shown = 8;  ///< cases and starts with pictures in the report
  double page_mb = 20;    ///< bytes of report.html; pictures that do not fit lie beside it
  bool dry_run = false, no_cache = false, quiet = false;
  std::vector<WantedDifference> differences;  ///< with dry_run
  bool gather = false;                        ///< run no cell: those without a row have failed
  std::size_t more_cases = 0;    ///< further seeds: the largest number for `compare`, the exact one for other commands
  std::size_t made_before = 0;   ///< rows that the same command made at earlier looks
  CallCounts calls_before;       ///< for these rows
  std::string tuned;             ///< name of the tuned variant that the experiment has; empty without one
  std::optional<Tuning> tuning;  ///< how it was found
  std::map<std::string, compare::CellRow> failed_before;  ///< the failed ones of these rows, by name; not tried again
  FileLimits file_limits;
};

/// Adds the arguments that all commands with an experiment share.
void add_experiment_arguments(CLI::App* command, CompareRequest& request);
/// Runs all cells that are not done yet, here or by tasks of a cluster. Then writes times, tables, pictures and the
/// report. The folder belongs to this experiment. Returns the exit code.
int run_comparison(const CompareRequest& request, const Catalogue& catalogue, const compare::Experiment& experiment,
                   const std::filesystem::path& folder);

/// Why cells may have no row, by their number in cells_of().
using LostCells = std::map<std::size_t, std::string>;
struct Gathered {
  int code = 0;      ///< 1 if cells are lost, 130 if it was interrupted
  std::string lost;  ///< how many cells have no row from any task, and the first ones with reasons; empty if none
};
/// Does the same from the existing rows and runs no cell; for request.gather. Cells without a row are lost: they count
/// as failed, for the reason in `reasons`.
Gathered gather_comparison(const CompareRequest& request, const Catalogue& catalogue,
                           const compare::Experiment& experiment, const std::filesystem::path& folder,
                           const LostCells& reasons);

/// Says why a comparison was stopped, and how to continue it. Returns the exit code, 130.
int stopped();

/// Checks before any cell runs that the cases have the items that the experiment's figures name. A worker runs the
/// nodes that name the items, for the first case and, if an item is missing there, for the last case. If both cases
/// lack an item, prints the faults and returns 2. Returns 0 if the comparison can run: also if the check was not
/// possible (a note says so), or if the first cells were done before. Returns 130 if it was interrupted. Makes
/// simulated cases only with `makes_cases`.
int check_items(const CompareRequest& request, const Catalogue& catalogue, const compare::Experiment& experiment,
                const std::filesystem::path& folder, const Store* store, bool makes_cases);

struct CellRows {
  std::vector<compare::CellRow> rows;
  std::size_t made = 0;  ///< rows that this call made
  CallCounts calls;      ///< for these
  compare::Dependencies dependencies;
};
/// Runs the cells that are not done yet and returns all rows. Nothing if it was interrupted.
std::optional<CellRows> run_cells(const CompareRequest& request, const Catalogue& catalogue,
                                  const compare::Experiment& experiment, const std::filesystem::path& folder);
/// Adds cases look by look, up to request.more_cases, until the experiment's rule says stop. Then writes everything, as
/// run_comparison() does. Throws Error if the experiment has no rule, or no look within so many cases.
int run_more_cases(const CompareRequest& request, const Catalogue& catalogue, const compare::Experiment& experiment,
                   const std::filesystem::path& folder);

/// Lets an optimizer choose the options under 'tune' on the training cases. Then compares the tuned variant with those
/// of the file on the cases that are held out, and writes everything, as run_comparison() does.
int run_tuning(const CompareRequest& request, const Catalogue& catalogue, const compare::Experiment& experiment,
               const std::filesystem::path& folder);

/// The experiment with the largest number of cases that run_more_cases() may use. Throws the same Errors.
compare::Experiment largest_experiment(const CompareRequest& request, const Catalogue& catalogue,
                                       const compare::Experiment& experiment);

/// Cells whose pictures go into the report: all variants of at most `most` pairs of case and start, the most important
/// pair first. These take turns: a pair where a variant was worst in the first metric, one where it was nearest to its
/// median, one where it has no value (first one for each reason), and one where it was best. The other pairs follow in
/// their order.
std::vector<compare::CellIndex> cells_to_show(const compare::Experiment& experiment,
                                              const std::vector<compare::CellRow>& rows, std::size_t most);

/// Reads "0.5", of the first figure, or "FIGURE=0.5". Throws Error for anything else.
WantedDifference wanted_difference(const std::string& text);
/// Which differences the cases of the experiment show, and how many cases each wanted difference takes, by the cells
/// that are done; empty without comparisons. Throws Error for a figure that the experiment does not have.
std::string needed_cases_text(const compare::Experiment& experiment, compare::CellRunner& runner,
                              const std::vector<WantedDifference>& wanted);

/// Prints what a comparison would do. Calls no node.
void print_plan(const compare::Experiment& experiment, const Catalogue& catalogue, const Store* store,
                const std::filesystem::path& folder);

/// The work that is left, in evaluations of nodes, and the seconds that these took in earlier runs.
struct WorkEstimate {
  double to_make = 0, unknown = 0;  ///< `unknown`: of nodes that never ran; the seconds do not include them
  double seconds = 0;
};
WorkEstimate estimate_of(const compare::Experiment& experiment, const Catalogue& catalogue, const Store* store,
                         const std::filesystem::path& folder);

/// A figure of merit of one variant, over those of its runs that have it.
struct VariantFigure {
  std::size_t count = 0, of = 0;            ///< runs that have it, and all
  compare::Summary summary;                 ///< meaningless if no run has it
  std::optional<compare::Interval> median;  ///< of metrics only: FigureOfCases::median_interval
};
/// What the verdicts of a variant are worth, over its completed cells that have one. Without limits under 'success', no
/// cell is a success or a miss, and only `cells` counts.
struct VerdictCounts {
  std::size_t cells = 0;
  std::size_t successes = 0, misses = 0;
  std::size_t silent = 0;        ///< silent failures: misses whose verdict is trusted. The other misses are caught.
  std::size_t false_alarms = 0;  ///< successes whose verdict is doubtful or wrong
  /// CaseRate::interval of the rates silent / misses and false_alarms / successes; 0 to 1 if there are none.
  compare::Interval silent_rate{0, 1}, false_alarm_rate{0, 1};
  std::size_t caught() const { return misses - silent; }
};
struct VariantSummary {
  std::size_t runs = 0, failed = 0;
  std::size_t incomplete = 0;  ///< runs that are done without one of the figures, because a node failed that may fail
  std::optional<compare::CaseRate> success;      ///< nothing without limits under 'success'
  std::vector<VariantFigure> figures;            ///< in the order of the experiment's metrics
  std::optional<compare::CaptureRange> capture;  ///< nothing without an initial_error, or without limits
  /// Runs whose start has no known error from any variant. They are not in `capture`.
  std::size_t unknown_starts = 0;
  VariantFigure seconds, evaluations;
  VerdictCounts verdicts;
};
/// Comparison of a variant with the baseline in one figure. There is one for each variant and metric, also if no case
/// can be compared: the number for Holm's correction must not depend on the results.
struct Finding {
  std::size_t variant = 0, metric = 0;
  compare::Comparison comparison;
  double p_holm = 1;  ///< over all that the experiment asks for: with 'compare_all' over all pairs
  std::string sentence;
};
/// Comparison of any two variants. `reference` is the baseline, or else the one that comes first in the file.
struct PairFinding {
  Finding finding;
  std::size_t reference = 0;
};
/// The variants in the order of a figure.
struct Ranking {
  struct Place {
    std::size_t variant = 0;
    std::size_t rank = 0;  ///< from 1; variants with the same median and as many lost runs share it
    /// Of all runs; one without the figure counts as worse than any other. Infinite if the median itself is such a run.
    double median = 0;
    std::size_t lost = 0;  ///< runs without the figure
    std::string group;     ///< letters: no test tells apart two variants that share one; empty if there are too many
  };
  std::vector<Place> places;  ///< best first
  /// Variants beside the first that no test tells from it, and that a test shows to be better than it, case by case.
  std::vector<std::size_t> like_best, better_than_best;
  std::size_t pairs = 0, different = 0;  ///< all pairs, and those that a test tells apart
};
/// What one level of a factor does to a figure, against the factor's first level: each run is compared with the run of
/// the same case, start and levels of all other factors.
struct Effect {
  std::size_t factor = 0, level = 0, metric = 0;
  compare::Comparison comparison;
  std::string sentence;
};
/// A figure at one value of a swept option, or at the values in one bin.
struct CurvePoint {
  double value = 0;                           ///< mean of the values
  std::size_t runs = 0, of = 0;               ///< those that have the figure, and all
  double middle = 0;                          ///< median of the figure, or success rate; 0 without runs
  std::optional<compare::Interval> interval;  ///< FigureOfCases::median_interval, or CaseRate::interval
};
/// A figure over a swept option. All variants with the same value count, whatever their other options.
struct Curve {
  std::string variant;  ///< whose option is swept; empty for the unchanged pipeline
  std::size_t option = 0;
  std::optional<std::size_t> metric;  ///< nothing for the success rate
  std::vector<CurvePoint> points;     ///< by rising value
};

struct Answer {
  std::vector<Curve> curves;     ///< none without a sweep
  std::optional<Tuning> tuning;  ///< as in CompareRequest
  std::string times;             ///< TimedCells::sentence
  std::vector<VariantSummary> variants;
  std::vector<Finding> findings;   ///< with the baseline
  std::vector<PairFinding> pairs;  ///< all of them; only with 'compare_all'
  std::vector<Ranking> rankings;   ///< for each metric; only with 'compare_all'
  std::vector<Effect> effects;     ///< only where 'matrix' combines at least two factors
  std::vector<std::string> units;  ///< FigureUnits::of_metrics
  std::string initial_error_unit;
  std::vector<bool> same_runs;        ///< for each metric, whether all variants have it in the same cases and starts
  std::optional<compare::Look> look;  ///< what the experiment's rule says of its cases
  std::string look_sentence;
};

using RowsOfVariant = std::vector<const compare::CellRow*>;
/// The rows of each variant, in the order of the experiment.
std::vector<RowsOfVariant> rows_by_variant(const compare::Experiment& experiment,
                                           const std::vector<compare::CellRow>& rows);
/// The values of a figure in the rows that have it.
struct FigureOfCases {
  std::vector<double> all;
  compare::ValuesOfCases cases;
  /// The interval of the median of all values; nothing if there are too few cases for this confidence.
  std::optional<compare::Interval> median_interval(double confidence = 0.95) const;
};
FigureOfCases figure_of_cases(const RowsOfVariant& rows, std::size_t metric);
/// A pair of values for each case and start; empty for a run without the figure.
std::vector<compare::Pair> cell_pairs(const RowsOfVariant& baseline, const RowsOfVariant& variant, std::size_t metric);

/// `rows` are those of all cells; failed ones have no figures. Throws Error as FigureUnits::add() does.
Answer answer_of(const compare::Experiment& experiment, const std::vector<compare::CellRow>& rows);
/// Compares each variant with the baseline, or all pairs with 'compare_all', and ranks the variants then. The units are
/// known.
void add_findings(const compare::Experiment& experiment, const std::vector<RowsOfVariant>& rows, Answer& answer);
/// Adds the main effects of the matrix, figure by figure. The units are known.
void add_effects(const compare::Experiment& experiment, const std::vector<RowsOfVariant>& rows, Answer& answer);
/// "best in mTRE: a; 7 of 15 pairs differ; not told apart from it: b, c"
std::string ranking_sentence(const compare::Experiment& experiment, const Answer& answer, std::size_t metric);
/// The response curves of all swept options: on a grid a point for each value, else in eight bins of the range.
std::vector<Curve> curves_of(const compare::Experiment& experiment, const std::vector<RowsOfVariant>& rows);
nlohmann::json curves_json(const compare::Experiment& experiment, const std::vector<Curve>& curves);

/// The answer as a table for the terminal.
std::string table_text(const compare::Experiment& experiment, const Answer& answer);
/// The complete answer; docs/comparing.md lists the keys.
nlohmann::json answer_json(const compare::Experiment& experiment, const Answer& answer);
/// Writes cells.csv, cells.jsonl, poses.csv, poses.jsonl and comparison.json.
void write_tables(const compare::Experiment& experiment, const std::vector<compare::CellRow>& rows,
                  const Answer& answer, const std::filesystem::path& folder);

/// The unit of each figure of an experiment. Numbers in metres and in millimetres are never put together.
class FigureUnits {
 public:
  explicit FigureUnits(const compare::Experiment& experiment);

  /// Takes the units of rows of this experiment, or of one with the same figures. Throws Error if a figure has another
  /// unit in one cell than in another, also if it has none in one of them. Cells without the figure do not count.
  void add(const std::vector<compare::CellRow>& rows);

  /// Of the experiment's metrics, in their order; empty for a number without a unit, and if no row has the figure.
  std::vector<std::string> of_metrics() const;
  /// Of the figure under 'initial_error'.
  const std::string& of_initial_error() const { return figures_.back().unit; }

 private:
  struct Figure {
    std::string path, unit;
    std::string cell;  ///< the first one that has it; empty if there is none yet
  };
  static void add(Figure& figure, const std::string& unit, const std::string& cell);

  std::vector<Figure> figures_;  ///< the metrics, and the initial error
};

/// The cells that are timed: of each variant those of the same cases and starts.
class TimedCells {
 public:
  /// `rows` are those of all cells, in the order of cells_of().
  TimedCells(const compare::Experiment& experiment, const std::vector<compare::CellRow>& rows);

  /// Numbers of the cells, in the order in which they are timed. The variants take turns, and their order is reversed
  /// from one case and start to the next, so that none always comes first.
  const std::vector<std::size_t>& numbers() const { return numbers_; }
  /// Removes the times of cases and starts in which not every variant has one, and times that were not measured now.
  void keep_complete(std::vector<compare::CellRow>& rows);
  /// What was measured, for people.
  std::string sentence(bool has_store) const;

 private:
  std::size_t asked_, variants_;
  std::size_t places_ = 0, lost_ = 0;
  bool has_fewer_ = false;   ///< fewer than requested, because some failed
  std::string without_any_;  ///< names of variants that were done nowhere
  std::vector<std::size_t> numbers_;
};

}  // namespace marrow::cli
