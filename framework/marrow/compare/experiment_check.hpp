// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "experiment_text.hpp"

namespace marrow::compare {

struct CheckedPipelines {
  std::vector<std::string> notes;  ///< of all variants: what one variant does not use, another may need
  std::vector<NamedItem> items;    ///< Experiment::named_items
};

/// Reads the pipelines with the inputs of the cells and the changes of each variant. Checks that they have everything
/// that the experiment names.
CheckedPipelines check_pipelines(const WrittenExperiment& written, const Catalogue& catalogue,
                                 Diagnostics& diagnostics);

}  // namespace marrow::compare
