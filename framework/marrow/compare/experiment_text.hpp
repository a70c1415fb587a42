// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <vector>

#include "experiment_yaml.hpp"

namespace marrow::compare {

/// An experiment with everything that is drawn for it. The places in its file are those of names that can only be
/// checked against the pipelines.
struct WrittenExperiment {
  Experiment experiment;
  Place simulation_place;
  std::vector<Place> picture_places;
};

WrittenExperiment read_written_experiment(const std::filesystem::path& file, Diagnostics& diagnostics,
                                          std::size_t more_cases);

/// Reads the section 'cases': folders, seeds, and simulations whose inputs are drawn. `experiment.more_cases` seeds
/// follow those that it names.
void read_cases(StrictYaml& yaml, const YamlEntry& section, WrittenExperiment& written);

}  // namespace marrow::compare
