// SPDX-License-Identifier: Apache-2.0
// What a dry run says of differences: which ones the cases of the file show, and how many cases others take.
#include <algorithm>
#include <filesystem>
#include <set>

#include "compare/comparison.hpp"
#include "compare/figure_units.hpp"
#include "marrow/base/error.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/base/printable.hpp"
#include "marrow/compare/experiment_notes.hpp"
#include "marrow/compare/needed_cases.hpp"
#include "marrow/runtime/pipeline/pipeline_names.hpp"

namespace marrow::cli {
namespace {

using compare::CellRow;
using compare::Experiment;

constexpr std::size_t kMostRows = 1000;  // to find the key of one takes some milliseconds
constexpr double kProbability = 0.8;

/// The rows of cells that are done, of the first cases.
std::vector<CellRow> rows_there_are(const Experiment& experiment, compare::CellRunner& runner) {
  std::vector<CellRow> rows;
  runner.keep_dependencies();
  for (const compare::CellIndex& cell : compare::cells_of(experiment)) {
    if (rows.size() >= kMostRows) break;
    if (!std::filesystem::exists(runner.folder_of(cell) / "cell.json")) continue;
    if (std::optional<CellRow> row = runner.finished(cell, runner.key_of(cell))) rows.push_back(std::move(*row));
  }
  return rows;
}

/// How far the differences of a figure scatter over cases: those of the pair of variants that scatter most.
struct Spread {
  double value = 0;
  std::size_t cases = 0;
  std::size_t variant = 0, reference = 0;
};

std::optional<Spread> spread_of(const Experiment& experiment, const std::vector<RowsOfVariant>& rows,
                                std::size_t metric) {
  std::optional<Spread> widest;
  for (std::size_t reference = 0; reference < rows.size(); ++reference) {
    if (!experiment.compare_all && reference != experiment.baseline) continue;
    for (std::size_t variant = 0; variant < rows.size(); ++variant) {
      if (variant == reference || (experiment.compare_all && variant < reference)) continue;
      std::vector<compare::Pair> pairs = cell_pairs(rows[reference], rows[variant], metric);
      std::erase_if(pairs, [](const compare::Pair& pair) { return !pair.reference || !pair.variant; });
      const auto differences = compare::case_differences(pairs, experiment.metrics[metric].higher_is_better()).of_both;
      const auto scatter = compare::spread_of_differences(differences);
      if (scatter && (!widest || *scatter > widest->value)) widest = {*scatter, differences.size(), variant, reference};
    }
  }
  return widest;
}

/// Seconds of work that a case took: of all its variants and starts, without what was read back.
double seconds_of_case(const std::vector<CellRow>& rows) {
  std::set<std::string> cases;
  double seconds = 0;
  for (const CellRow& row : rows) {
    cases.insert(row.case_name);
    for (const auto& [name, calls] : row.nodes)
      if (calls.made) seconds += calls.seconds * double(calls.made) / double(calls.made + calls.cached);
  }
  return cases.empty() ? 0 : seconds / double(cases.size());
}

class Needed {
 public:
  Needed(const Experiment& experiment, const std::vector<CellRow>& rows)
      : experiment_(experiment), counts_(compare::comparison_counts(experiment)), units_(experiment) {
    units_.add(rows);
    case_seconds_ = seconds_of_case(rows);
    const std::vector<RowsOfVariant> of_variant = rows_by_variant(experiment, rows);
    for (std::size_t m = 0; m < experiment.metrics.size(); ++m)
      spreads_.push_back(spread_of(experiment, of_variant, m));
  }

  /// One line for each figure.
  std::string of_this_file() const {
    std::string text;
    for (std::size_t m = 0; m < spreads_.size(); ++m) {
      if (!spreads_[m]) continue;
      const Spread& scatter = *spreads_[m];
      const auto least = compare::difference_to_show(scatter.value, counts_.cases, counts_.comparisons, kProbability);
      text += "  " + printable(experiment_.metrics[m].label) + ": " +
              (least ? amount(*least, m) : std::string("none")) + "; differences scatter by " +
              amount(scatter.value, m) + " over " + counted(scatter.cases, "case") + ", " +
              printable(experiment_.variants[scatter.variant].name) + " against " +
              printable(experiment_.variants[scatter.reference].name) + "\n";
    }
    if (text.empty())
      return "which differences these cases show is known when three cases are done with two variants\n";
    return formatted("differences that {} show with a probability of about 80 %, by the cells that are done:\n",
                     counted(counts_.cases, "case")) +
           text;
  }

  std::string of_difference(const WantedDifference& wanted) const {
    const std::size_t m = number_of(wanted.figure);
    const std::string what =
        "a difference of " + amount(wanted.amount, m) + " in " + printable(experiment_.metrics[m].label);
    if (!spreads_[m]) return what + ": how many cases it takes is known when three cases are done with two variants\n";
    const auto cases = compare::cases_to_show(wanted.amount, spreads_[m]->value, counts_.comparisons, kProbability);
    if (!cases) return what + formatted(" takes more than {} cases\n", compare::kMostNeededCases);
    std::string text = what + " takes about " + counted(*cases, "case");
    if (case_seconds_ > 0) text += formatted(", {} s of work in all", short_number(case_seconds_ * double(*cases), 2));
    return text + "\n";
  }

 private:
  std::string amount(double value, std::size_t m) const {
    const std::string unit = units_.of_metrics()[m];
    return short_number(value, 2) + (unit.empty() ? "" : " " + printable(unit));
  }
  std::size_t number_of(const std::string& figure) const {
    if (figure.empty()) return 0;
    std::vector<std::string> known;
    for (std::size_t m = 0; m < experiment_.metrics.size(); ++m) {
      if (experiment_.metrics[m].path == figure) return m;
      known.push_back(experiment_.metrics[m].path);
    }
    throw Error("--difference: the experiment has no figure '" + figure + "'; " + suggestion(figure, known));
  }

  const Experiment& experiment_;
  compare::ComparisonCounts counts_;
  FigureUnits units_;
  double case_seconds_ = 0;
  std::vector<std::optional<Spread>> spreads_;
};

}  // namespace

WantedDifference wanted_difference(const std::string& text) {
  const std::size_t equals = text.rfind('=');
  const std::string number = equals == std::string::npos ? text : text.substr(equals + 1);
  const std::optional<double> amount = parsed_number(number);
  if (!amount || !(*amount > 0) || *amount > 1e300)
    throw Error("--difference: '" + text +
                "' is no difference; write an amount above 0 in the figure's unit, such as "
                "0.5, which is of the first figure, or  errors.distal.final.mtre_mm=0.5");
  return {equals == std::string::npos ? "" : text.substr(0, equals), *amount};
}

std::string needed_cases_text(const Experiment& experiment, compare::CellRunner& runner,
                              const std::vector<WantedDifference>& wanted) {
  if (!compare::comparison_counts(experiment).comparisons) return "";
  const Needed needed(experiment, rows_there_are(experiment, runner));
  std::string text = needed.of_this_file();
  for (const WantedDifference& one : wanted) text += needed.of_difference(one);
  return text;
}

}  // namespace marrow::cli
