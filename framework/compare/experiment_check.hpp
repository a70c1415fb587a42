// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "experiment_text.hpp"

namespace marrow::compare {

/// Reads the pipelines with the inputs of the cells and the changes of each variant. Checks that they have everything
/// that the experiment names. Returns the notes that the pipelines of all variants have: what one variant alone does
/// not use may be what another needs.
std::vector<std::string> check_pipelines(const WrittenExperiment& written, const Catalogue& catalogue,
                                         Diagnostics& diagnostics);

}  // namespace marrow::compare
