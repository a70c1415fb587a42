// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "experiment_text.hpp"

namespace marrow::compare {

/// Reads the pipelines with the inputs that cells give them and each variant's changes, and looks for all that the
/// experiment names in them.
void check_pipelines(const WrittenExperiment& written, const Catalogue& catalogue, Diagnostics& diagnostics);

}  // namespace marrow::compare
