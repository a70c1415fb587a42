// SPDX-License-Identifier: Apache-2.0
#include "marrow/compare/experiment.hpp"

#include <cmath>

#include "draw.hpp"
#include "experiment_sections.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/compare/bootstrap.hpp"
#include "marrow/compare/case_rate.hpp"
#include "marrow/runtime/pipeline/pipeline_names.hpp"

namespace marrow::compare {
namespace {

namespace fs = std::filesystem;

std::string list_text(const std::array<double, 3>& values) {
  return "[" + exact_number(values[0]) + ", " + exact_number(values[1]) + ", " + exact_number(values[2]) + "]";
}

template <class Named>
std::optional<std::size_t> place_of_name(const std::vector<Named>& all, const std::string& name) {
  const Named* found = find_named(all, name);
  return found ? std::optional(std::size_t(found - all.data())) : std::nullopt;
}

void add_seeded(const SeededInputs& seeded, std::uint64_t seed, std::vector<InputValue>& inputs) {
  for (InputValue& input : draw_inputs(seeded.drawn, seed)) inputs.push_back(std::move(input));
  for (const auto& [name, place] : seeded.taking_seed) inputs.push_back({name, formatted("{}", seed), place});
}

std::string note_of_comparisons(const Experiment& experiment) {
  const auto [comparisons, cases, fewest] = comparison_counts(experiment);
  if (cases >= fewest) return "";
  return formatted(
      "{} cannot show a difference{}: even if all go the same way, p stays above 0.05{}; it takes at least {}",
      counted(cases, experiment.tune ? "held-out case" : "case"),
      comparisons == 1 ? "" : formatted(" among {} comparisons", comparisons),
      comparisons == 1 ? "" : " after Holm's correction", fewest);
}

/// Why no result of the cells can meet the rule at its last look; empty if one can.
std::string fault_of_last_look(const StopRule& rule, std::size_t starts) {
  const double level = StopPlan(rule).level_at(rule.most_cases);
  const std::string fewest = formatted("{}", fewest_cases(level));
  if (rule.goal == StopRule::Goal::difference)
    return rule.most_cases < fewest_cases(level)
               ? formatted("p must be below {:.2g}, which takes at least {} cases", level, fewest)
               : "";
  if (rule.metric) {
    const std::vector<double> equal(rule.most_cases, 0.0);  // as narrow as an interval can be
    return std::isfinite(order_statistic_interval(equal, level).lower)
               ? ""
               : "there is no interval of a median with its confidence, which takes at least " + fewest + " cases";
  }
  CaseRate best;  // all runs independent
  for (std::size_t run = 0; run < rule.most_cases * starts; ++run) best.add(formatted("{}", run), true);
  const Interval narrowest = best.exact_interval(1 - level);
  const double width = narrowest.upper - narrowest.lower;
  return width > rule.width
             ? formatted("the interval of a success rate is at least {:.2g} wide, even if every run is a success",
                         width)
             : "";
}

}  // namespace

std::vector<CellIndex> cells_of(const Experiment& experiment) {
  std::vector<CellIndex> cells;
  cells.reserve(experiment.cell_count());
  for (std::size_t c = 0; c < experiment.cases.size(); ++c)
    for (std::size_t s = 0; s < experiment.starts.size(); ++s)
      for (std::size_t v = 0; v < experiment.variants.size(); ++v) cells.push_back({v, c, s});
  return cells;
}

std::string cell_id(const Experiment& experiment, const CellIndex& cell) {
  return experiment.variants[cell.variant].name + "/" + experiment.cases[cell.case_index].name + "/" +
         experiment.starts[cell.start].name;
}

std::optional<CellIndex> cell_of(const Experiment& experiment, const std::string& id) {
  const std::size_t first = id.find('/'), second = id.find('/', first + 1);  // names have no slashes
  if (first == std::string::npos || second == std::string::npos) return std::nullopt;
  const auto variant = place_of_name(experiment.variants, id.substr(0, first));
  const auto one = place_of_name(experiment.cases, id.substr(first + 1, second - first - 1));
  const auto start = place_of_name(experiment.starts, id.substr(second + 1));
  if (!variant || !one || !start) return std::nullopt;
  return CellIndex{*variant, *one, *start};
}

PipelineArguments arguments_of(const Experiment& experiment, const CellIndex& cell, const fs::path& case_folder) {
  PipelineArguments arguments;
  arguments.inputs = experiment.inputs;
  const ExperimentCase& one = experiment.cases[cell.case_index];
  if (one.is_simulated || !one.folder.empty())
    arguments.inputs.push_back({experiment.case_input, fs::absolute(case_folder).string(), experiment.cases_place});
  else
    add_seeded(experiment.seeded, one.seed, arguments.inputs);
  arguments.overrides = experiment.common;
  const std::vector<Override>& own = experiment.variants[cell.variant].overrides;
  arguments.overrides.insert(arguments.overrides.end(), own.begin(), own.end());
  if (!experiment.protocol) return arguments;
  const StartProtocol& protocol = *experiment.protocol;
  const Start& start = experiment.starts[cell.start];
  arguments.overrides.push_back({protocol.node + ".rotation_deg", list_text(start.rotation_deg), protocol.place});
  arguments.overrides.push_back({protocol.node + ".translation_mm", list_text(start.translation_mm), protocol.place});
  if (protocol.distance_mm > 0)
    arguments.overrides.push_back({protocol.node + ".distance_mm", exact_number(start.distance_mm), protocol.place});
  return arguments;
}

PipelineArguments simulation_arguments_of(const Experiment& experiment, std::size_t case_index) {
  const CaseSimulation& simulation = experiment.simulation;
  PipelineArguments arguments{simulation.inputs, simulation.changes};
  add_seeded(simulation.seeded, experiment.cases[case_index].seed, arguments.inputs);
  return arguments;
}

ComparisonCounts comparison_counts(const Experiment& experiment) {
  ComparisonCounts counts;
  counts.cases = experiment.cases.size() - (experiment.tune ? experiment.tune->training_cases : 0);
  const std::size_t variants = experiment.variants.size() + (experiment.tune ? 1 : 0);
  counts.comparisons =
      (experiment.compare_all ? variants * (variants - 1) / 2 : variants - 1) * experiment.metrics.size();
  if (counts.comparisons) counts.fewest_cases = fewest_cases(0.05, counts.comparisons);
  return counts;
}

std::vector<std::string> notes_of(const Experiment& experiment) {
  std::vector<std::string> notes;
  if (std::string note = note_of_comparisons(experiment); !note.empty()) notes.push_back(std::move(note));
  if (experiment.stop)
    if (const std::string fault = fault_of_last_look(*experiment.stop, experiment.starts.size()); !fault.empty())
      notes.push_back("the rule under 'stop' can never be met: at its last look, at " +
                      counted(experiment.stop->most_cases, "case") + ", " + fault);
  if (!experiment.initial_error.empty() && !experiment.defines_success())
    notes.push_back("there is no capture range over '" + experiment.initial_error +
                    "': without limits under 'success', no run is a success or a miss");
  return notes;
}

void set_factors(Experiment& experiment, const std::vector<std::vector<Override>>& columns,
                 std::vector<Variant>& combined) {
  if (!experiment.variants.empty()) {
    Factor& named = experiment.factors.emplace_back("variants");
    for (const Variant& variant : experiment.variants) named.levels.push_back(variant.name);
  }
  for (const std::vector<Override>& column : columns) {
    Factor& factor = experiment.factors.emplace_back(column.front().key);
    for (const Override& one : column) factor.levels.push_back(one.value);
  }
  for (std::size_t v = 0; v < combined.size(); ++v) {
    combined[v].levels.resize(experiment.factors.size());
    std::size_t rest = v;
    for (std::size_t f = experiment.factors.size(); f-- > 0; rest /= experiment.factors[f].levels.size())
      combined[v].levels[f] = rest % experiment.factors[f].levels.size();
  }
}

void read_compare_all(StrictYaml& yaml, const YamlEntry& entry, Experiment& experiment) {
  experiment.compare_all = yaml.boolean(entry.value, entry.place, "compare_all").value_or(false);
  experiment.compare_all_place = entry.place;
}

void check_compare_all(StrictYaml& yaml, const Experiment& experiment) {
  const std::size_t comparisons = comparison_counts(experiment).comparisons;
  if (!experiment.compare_all || comparisons <= kMostComparisons) return;
  yaml.fault(
      experiment.compare_all_place,
      formatted("all pairs of {} variants in {} are {} comparisons, at most {} can be made", experiment.variants.size(),
                counted(experiment.metrics.size(), "figure"), comparisons, kMostComparisons),
      "leave variants or figures out, or compare each with the baseline alone");
}

}  // namespace marrow::compare
