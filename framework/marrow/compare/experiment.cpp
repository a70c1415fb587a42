// SPDX-License-Identifier: Apache-2.0
#include "marrow/compare/experiment.hpp"

#include "draw.hpp"
#include "marrow/base/number_text.hpp"
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

}  // namespace marrow::compare
