// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>

#include "marrow/compare/cell.hpp"

namespace marrow::cli {

/// A sentence about cases whose folders have the same content: copies, or simulations that do not use the seed. Each of
/// them counts as a case of its own, so what they show is counted more often than it was seen. Empty if there are none.
/// The runner keeps its dependencies, and has the keys of the cells.
std::string doubled_cases_text(const compare::Experiment& experiment, const compare::CellRunner& runner);

}  // namespace marrow::cli
