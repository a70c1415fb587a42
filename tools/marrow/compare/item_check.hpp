// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "compare/comparison.hpp"

namespace marrow::cli {

/// Looks whether the cases have the items that the experiment's figures name, before any cell runs: only the nodes run
/// that name the items, for the first case and, where it lacks one, for the last case. They run in a worker process. If
/// none of the two has an item, prints the faults and returns 2. Returns 0 if the comparison can run: also if nothing
/// could be learned, which a note says, and where the first cells were already done. Returns 130 if it was interrupted.
/// A simulated case is made only with `makes_cases`.
int check_items(const CompareRequest& request, const Catalogue& catalogue, const compare::Experiment& experiment,
                const std::filesystem::path& folder, const Store* store, bool makes_cases);

}  // namespace marrow::cli
