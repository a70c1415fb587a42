// SPDX-License-Identifier: Apache-2.0
#pragma once
// The commands that compare variants.
#include <filesystem>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "compare/tuning.hpp"
#include "marrow/compare/case_rate.hpp"
#include "marrow/compare/cell.hpp"
#include "marrow/compare/experiment.hpp"
#include "marrow/compare/statistics.hpp"

namespace CLI {
class App;
}

namespace marrow::cli {

struct CompareRequest {
  std::filesystem::path file;
  std::filesystem::path folder;  ///< empty = runs/compare/NAME
  int jobs = 0;                  ///< number of cells at once; 0 = the number of the machine's cores
  int threads = 1;               ///< threads of each cell
  double time_limit_s = 600;
  double memory_limit_mb = 4000;
  std::size_t shown = 8;  ///< cases and starts with pictures in the report
  double page_mb = 20;    ///< bytes of report.html; pictures that do not fit lie beside it
  bool dry_run = false, no_cache = false, quiet = false;
  bool gather = false;           ///< run no cell: those without a row have failed
  std::size_t more_cases = 0;    ///< further seeds; for `compare` at most so many, for other commands exactly
  std::size_t made_before = 0;   ///< rows that the same command made at earlier looks
  std::string tuned;             ///< name of the tuned variant that the experiment has; empty without one
  std::optional<Tuning> tuning;  ///< how it was found
  std::map<std::string, compare::CellRow> failed_before;  ///< of these the failed ones, by their names; not tried again
  FileLimits file_limits;
};

/// Adds the arguments that all commands with an experiment share.
void add_experiment_arguments(CLI::App* command, CompareRequest& request);
/// Why cells have no row, by their number in cells_of().
using LostCells = std::map<std::size_t, std::string>;
/// Runs all cells that are not done yet, here or by tasks of a cluster. Then writes times, tables, pictures and the
/// report. The folder belongs to this experiment. With request.gather, cells that are not done have failed, for the
/// reason in `lost`.
int run_comparison(const CompareRequest& request, const Catalogue& catalogue, const compare::Experiment& experiment,
                   const std::filesystem::path& folder, const LostCells& lost = {});

/// Says why a comparison was stopped, and how it goes on. Returns the exit code, 130.
int stopped();

struct CellRows {
  std::vector<compare::CellRow> rows;
  std::size_t made = 0;  ///< those that were not there already
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

/// The experiment with the most cases that run_more_cases() may take. Throws Error as that does.
compare::Experiment largest_experiment(const CompareRequest& request, const Catalogue& catalogue,
                                       const compare::Experiment& experiment);

/// Cells whose pictures go into the report: all variants of at most `most` pairs of case and start, the most important
/// pair first. In turn come one where a variant was worst in the first metric, one where it was nearest to its median,
/// one where it failed, and one where it was best; of the failed ones first one for each reason. Then come the others,
/// in their order.
std::vector<compare::CellIndex> cells_to_show(const compare::Experiment& experiment,
                                              const std::vector<compare::CellRow>& rows, std::size_t most);

/// Prints what a comparison would do. Calls no node.
void print_plan(const compare::Experiment& experiment, const Catalogue& catalogue, const Store* store,
                const std::filesystem::path& folder);

/// What is left to do, in evaluations of nodes, and the seconds that these took in earlier runs.
struct WorkEstimate {
  double to_make = 0, unknown = 0;  ///< `unknown`: of nodes that never ran, which the seconds leave out
  double seconds = 0;
};
WorkEstimate estimate_of(const compare::Experiment& experiment, const Catalogue& catalogue, const Store* store,
                         const std::filesystem::path& folder);

/// A figure of merit of one variant, over its completed cells.
struct VariantFigure {
  std::size_t count = 0;
  compare::Summary summary;
  bool has_interval = false;       ///< of metrics only, from two cases on
  compare::Interval median{0, 0};  ///< median_of_runs_interval
};
/// What the verdicts of a variant are worth, over its completed cells that have one.
struct VerdictCounts {
  std::size_t cells = 0;
  std::size_t misses = 0;        ///< cells that are no success
  std::size_t silent = 0;        ///< silent failures: misses whose verdict is trusted. The other misses are caught.
  std::size_t false_alarms = 0;  ///< successes whose verdict is doubtful or wrong
  /// CaseRate::interval of the rates silent / misses and false_alarms / successes; 0 to 1 if there are none.
  compare::Interval silent_rate{0, 1}, false_alarm_rate{0, 1};
  std::size_t caught() const { return misses - silent; }
  std::size_t successes() const { return cells - misses; }
};
struct VariantSummary {
  std::size_t runs = 0, failed = 0, successes = 0;
  compare::Interval success;           ///< CaseRate::interval
  double effective_runs = 0;           ///< CaseRate::effective_runs
  std::vector<VariantFigure> figures;  ///< in the order of the experiment's metrics
  compare::CaptureRange capture;       ///< without bins if the experiment names no initial_error
  std::size_t unknown_starts =
      0;  ///< failed runs whose start has no known error from any variant; they are not in `capture`
  VariantFigure seconds, evaluations;
  VerdictCounts verdicts;
};
/// Comparison of a variant with the baseline in one figure.
struct Finding {
  std::size_t variant = 0, metric = 0;
  compare::Comparison comparison;
  double p_holm = 1;
  std::string sentence;
};
/// A figure at one value of a swept option, or at those in one bin.
struct CurvePoint {
  double value = 0;  ///< mean of the values
  std::size_t runs = 0;
  double middle = 0;                          ///< median of the figure, or success rate; 0 without runs
  std::optional<compare::Interval> interval;  ///< median_of_runs_interval, from two cases on, or CaseRate::interval
};
/// A figure over a swept option. All variants with the same value count, whatever their other options.
struct Curve {
  std::string variant;  ///< whose option is swept; empty for the pipeline as it is
  std::size_t option = 0;
  std::optional<std::size_t> metric;  ///< nothing for the success rate
  std::vector<CurvePoint> points;     ///< by rising value
};

struct Answer {
  std::vector<Curve> curves;     ///< none without a sweep
  std::optional<Tuning> tuning;  ///< as in CompareRequest
  std::vector<VariantSummary> variants;
  std::vector<Finding> findings;
  std::vector<std::string> units;     ///< units of the metrics; empty if no cell is done
  std::optional<compare::Look> look;  ///< what the experiment's rule says of its cases
  std::string look_sentence;
};

using RowsOfVariant = std::vector<const compare::CellRow*>;
/// The rows of each variant, in the order of the experiment.
std::vector<RowsOfVariant> rows_by_variant(const compare::Experiment& experiment,
                                           const std::vector<compare::CellRow>& rows);
/// The values of one figure in the cells that both variants completed.
std::vector<compare::Pair> cell_pairs(const RowsOfVariant& baseline, const RowsOfVariant& variant, std::size_t metric);
/// Applies the rule 'stop' of the experiment, if it has one, to its cases. The units are known.
void add_look(const compare::Experiment& experiment, const std::vector<RowsOfVariant>& rows, Answer& answer);

/// `rows` may come from an unfinished comparison. Failed cells have no figures. The pairs of a finding are the cells
/// that both variants completed.
Answer answer_of(const compare::Experiment& experiment, const std::vector<compare::CellRow>& rows);
/// The response curves of all swept options: on a grid a point for each value, else in eight bins of the range.
std::vector<Curve> curves_of(const compare::Experiment& experiment, const std::vector<RowsOfVariant>& rows);
nlohmann::json curves_json(const compare::Experiment& experiment, const std::vector<Curve>& curves);
/// Counts silent failures and false alarms.
VerdictCounts verdict_counts(const compare::Experiment& experiment, const std::vector<const compare::CellRow*>& rows);
/// The counts of all variants as a table for the terminal; empty if no cell has a verdict.
std::string verdict_table(const compare::Experiment& experiment, const Answer& answer);

/// The answer as a table for the terminal.
std::string table_text(const compare::Experiment& experiment, const Answer& answer);
/// The complete answer: {experiment, variants, comparisons}.
nlohmann::json answer_json(const compare::Experiment& experiment, const Answer& answer);
/// Writes cells.csv, cells.jsonl and comparison.json.
void write_tables(const compare::Experiment& experiment, const std::vector<compare::CellRow>& rows,
                  const Answer& answer, const std::filesystem::path& folder);

}  // namespace marrow::cli
