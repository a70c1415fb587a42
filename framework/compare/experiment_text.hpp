// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <vector>

#include "experiment_yaml.hpp"

namespace marrow::compare {

/// An experiment with all that is drawn for it, and where in its file the names stand that only its pipelines can tell
/// to be right.
struct WrittenExperiment {
  Experiment experiment;
  Place simulation_place, initial_error_place;
  std::vector<Place> metric_places, picture_places;
};

WrittenExperiment read_written_experiment(const std::filesystem::path& file, Diagnostics& diagnostics);

/// The section 'cases': folders, and simulations whose inputs are drawn.
void read_cases(StrictYaml& yaml, const YamlEntry& section, const std::filesystem::path& folder,
                WrittenExperiment& written);

}  // namespace marrow::compare
