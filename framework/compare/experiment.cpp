// SPDX-License-Identifier: Apache-2.0
#include "marrow/compare/experiment.hpp"

#include "draw.hpp"
#include "experiment_check.hpp"

namespace marrow::compare {
namespace {

namespace fs = std::filesystem;

std::string list_text(const std::array<double, 3>& values) {
  return "[" + number_text(values[0]) + ", " + number_text(values[1]) + ", " + number_text(values[2]) + "]";
}

}  // namespace

std::vector<CellIndex> cells_of(const Experiment& experiment) {
  std::vector<CellIndex> cells;
  for (std::size_t c = 0; c < experiment.cases.size(); ++c)
    for (std::size_t s = 0; s < experiment.starts.size(); ++s)
      for (std::size_t v = 0; v < experiment.variants.size(); ++v) cells.push_back({v, c, s});
  return cells;
}

std::string cell_id(const Experiment& experiment, const CellIndex& cell) {
  return experiment.variants[cell.variant].name + "/" + experiment.cases[cell.case_index].name + "/" + experiment.starts[cell.start].name;
}

std::optional<CellIndex> cell_of(const Experiment& experiment, const std::string& id) {
  for (const CellIndex& cell : cells_of(experiment))
    if (cell_id(experiment, cell) == id) return cell;
  return std::nullopt;
}

PipelineArguments arguments_of(const Experiment& experiment, const CellIndex& cell, const fs::path& case_folder) {
  PipelineArguments arguments;
  arguments.inputs = experiment.inputs;
  const ExperimentCase& one = experiment.cases[cell.case_index];
  if (one.is_simulated || !one.folder.empty()) arguments.inputs.push_back({experiment.case_input, fs::absolute(case_folder).string(), experiment.cases_place});
  arguments.overrides = experiment.common;
  const std::vector<Override>& own = experiment.variants[cell.variant].overrides;
  arguments.overrides.insert(arguments.overrides.end(), own.begin(), own.end());
  if (!experiment.protocol) return arguments;
  const StartProtocol& protocol = *experiment.protocol;
  const Start& start = experiment.starts[cell.start];
  arguments.overrides.push_back({protocol.node + ".rotation_deg", list_text(start.rotation_deg), protocol.place});
  arguments.overrides.push_back({protocol.node + ".translation_mm", list_text(start.translation_mm), protocol.place});
  if (protocol.distance_mm > 0) arguments.overrides.push_back({protocol.node + ".distance_mm", number_text(start.distance_mm), protocol.place});
  return arguments;
}

PipelineArguments simulation_arguments_of(const Experiment& experiment, std::size_t case_index) {
  return {experiment.cases[case_index].inputs, experiment.simulation_changes};
}

Experiment read_experiment(const fs::path& file, const Catalogue& catalogue, Diagnostics& diagnostics) {
  WrittenExperiment written = read_written_experiment(file, diagnostics);
  if (diagnostics.empty()) check_pipelines(written, catalogue, diagnostics);
  return std::move(written.experiment);
}

}  // namespace marrow::compare
