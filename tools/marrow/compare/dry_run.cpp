// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <set>

#include "compare/comparison.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/base/printable.hpp"
#include "marrow/runtime/pipeline/pipeline_names.hpp"

namespace marrow::cli {
namespace {

namespace fs = std::filesystem;
using compare::CellIndex;
using compare::CellRow;
using compare::CellRunner;
using compare::Experiment;

/// Reading the pipeline of a cell takes some milliseconds. If there are more cells than this, a sample stands for all.
constexpr std::size_t kMostCells = 1000;

/// An evenly spread sample of `taken` out of `all` things.
struct Sample {
  std::size_t all = 0, taken = 0;
  std::size_t at(std::size_t i) const { return i * all / taken; }
  double weight() const { return double(all) / double(taken); }
};

std::pair<Sample, Sample> cases_and_starts(const Experiment& experiment) {
  Sample cases{experiment.cases.size(), experiment.cases.size()},
      starts{experiment.starts.size(), experiment.starts.size()};
  const std::size_t places = std::max<std::size_t>(1, kMostCells / experiment.variants.size());
  if (cases.all * starts.all > places) {
    cases.taken = std::min(cases.all, std::max(std::size_t(std::sqrt(double(places))), places / starts.all));
    starts.taken = std::clamp<std::size_t>(places / cases.taken, 1, starts.all);
  }
  return {cases, starts};
}

/// Numbers of evaluations, estimated from the sampled cells.
struct Counts {
  double all = 0, shared = 0, cached = 0;
  std::map<std::string, double> to_make;  ///< key: name of the node that is used
};

bool makes_functions(const PipelineNode& node) {
  for (const PortInfo& output : node.info.outputs)
    if (!output.type.is_function) return false;
  return true;
}

class Plan {
 public:
  Plan(const Experiment& experiment, const Catalogue& catalogue, const Store* store, const fs::path& folder)
      : experiment_(experiment),
        catalogue_(catalogue),
        store_(store),
        runner_(experiment, catalogue, store, folder, 1),
        samples_(cases_and_starts(experiment)) {
    const auto& [cases, starts] = samples_;
    for (std::size_t c = 0; c < cases.taken; ++c) {
      const fs::path place = runner_.case_place(cases.at(c));
      const bool is_there = place.empty() || fs::exists(place);
      if (experiment.cases[cases.at(c)].is_simulated && !is_there) cases_to_make_ += cases.weight();
      for (std::size_t s = 0; s < starts.taken; ++s)
        for (std::size_t v = 0; v < experiment.variants.size(); ++v)
          count_cell({v, cases.at(c), starts.at(s)}, place, is_there);
    }
  }

  void print() const;
  WorkEstimate estimate() const;

 private:
  void count_cell(const CellIndex& cell, const fs::path& place, bool is_there) {
    const Pipeline pipeline = runner_.pipeline_of(cell, place, CellRunner::Depth::figures);
    const std::vector<Digest> keys = compare::histories(pipeline, experiment_.cases[cell.case_index].name);
    const std::vector<compare::Dependence> dependences = compare::dependences(pipeline, experiment_);
    std::vector<PlannedNode> planned;
    if (store_ && is_there) {
      RunSettings settings;
      settings.store = store_;
      settings.seed = runner_.seed_of(cell.case_index);
      settings.remember = false;
      planned = plan_pipeline(pipeline, catalogue_, settings);
    }
    const auto& [cases, starts] = samples_;
    const std::vector<bool> needed = pipeline.needed();
    for (std::size_t i = 0; i < pipeline.nodes.size(); ++i) {
      if (!needed[i] || makes_functions(pipeline.nodes[i])) continue;
      const double all = cases.weight() * starts.weight();
      const double alike =
          (dependences[i].on_case ? cases.weight() : 1) * (dependences[i].on_start ? starts.weight() : 1);
      counts_.all += all;
      counts_.shared += all;
      if (!seen_.insert(keys[i]).second) continue;
      counts_.shared -= alike;
      if (!planned.empty() && planned[i].what == PlannedNode::What::cached)
        counts_.cached += alike;
      else
        counts_.to_make[pipeline.nodes[i].info.name] += alike;
    }
  }

  const Experiment& experiment_;
  const Catalogue& catalogue_;
  const Store* store_;
  const CellRunner runner_;
  std::pair<Sample, Sample> samples_;
  std::set<Digest> seen_;
  Counts counts_;
  double cases_to_make_ = 0;
};

/// Mean time of one call of each node in earlier runs.
std::map<std::string, double> seconds_before(const Store& store) {
  std::map<std::string, std::pair<double, long>> sums;
  for (const Store::Entry& entry : store.entries()) {
    sums[entry.provenance.node].first += entry.provenance.seconds;
    ++sums[entry.provenance.node].second;
  }
  std::map<std::string, double> means;
  for (const auto& [node, sum] : sums) means[node] = sum.first / double(sum.second);
  return means;
}

WorkEstimate Plan::estimate() const {
  WorkEstimate estimate;
  const std::map<std::string, double> before = store_ ? seconds_before(*store_) : std::map<std::string, double>();
  for (const auto& [node, count] : counts_.to_make) {
    estimate.to_make += count;
    const auto known = before.find(node);
    if (known == before.end())
      estimate.unknown += count;
    else
      estimate.seconds += known->second * count;
  }
  return estimate;
}

void Plan::print() const {
  const auto& [to_make, unknown, seconds] = estimate();
  const auto& [cases, starts] = samples_;
  const bool is_sample = cases.taken < cases.all || starts.taken < starts.all;
  std::printf("%zu cells: %zu variants, %zu cases, %zu starts\n", experiment_.cell_count(), experiment_.variants.size(),
              cases.all, starts.all);
  if (const auto counts = compare::comparison_counts(experiment_); counts.comparisons)
    std::printf("%s %s, for which a difference takes at least %zu cases\n",
                counted(counts.comparisons, "comparison").c_str(),
                experiment_.compare_all ? "of all pairs" : "with the baseline", counts.fewest_cases);
  if (is_sample)
    std::printf("looked at: %zu cases and %zu starts, evenly spread; by them there are about\n", cases.taken,
                starts.taken);
  if (cases_to_make_ > 0) std::printf("%.0f cases to simulate\n", cases_to_make_);
  std::printf("%.0f evaluations of nodes: %.0f shared, %.0f cached, %.0f to make\n", counts_.all, counts_.shared,
              counts_.cached, to_make);
  if (to_make > 0)
    std::printf("estimate from earlier runs: %.1f s of work, without cases to simulate, timed runs and pictures",
                seconds);
  if (unknown > 0) std::printf(", and without %.0f evaluations of nodes that never ran", unknown);
  if (to_make > 0) std::printf("\n");
}

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

void print_plan(const Experiment& experiment, const Catalogue& catalogue, const Store* store, const fs::path& folder) {
  Plan(experiment, catalogue, store, folder).print();
}

WorkEstimate estimate_of(const Experiment& experiment, const Catalogue& catalogue, const Store* store,
                         const fs::path& folder) {
  return Plan(experiment, catalogue, store, folder).estimate();
}

// What a dry run says of differences: which ones the cases of the file show, and how many cases others take.

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
