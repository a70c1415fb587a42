// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "experiment_text.hpp"

namespace marrow::compare {

/// Reads the pipelines with the inputs of the cells and the changes of each variant. Checks that they have everything
/// that the experiment names.
void check_pipelines(const WrittenExperiment& written, const Catalogue& catalogue, Diagnostics& diagnostics);

}  // namespace marrow::compare
