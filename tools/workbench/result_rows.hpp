// SPDX-License-Identifier: Apache-2.0
#pragma once
// The runs and comparisons of the opened folder, as the list of the page "Results" shows them.
#include "workbench/opened_folder.hpp"

namespace marrow::workbench {

/// [{folder, kind, name, when, status, seconds, verdicts, figures, has_report, case, changes, fault}], the newest
/// first. `kind` is run or comparison. `case`: of a run, relative to the opened folder; empty if it reads none.
/// `changes`:
/// [{what, before, now}], the options, nodes and inputs that differ from the run of the same pipeline before it; null
/// if there is no such run, or if it is not known. `fault` says why nothing else is known; otherwise it is missing.
nlohmann::json list_results(const OpenedFolder& folder);

}  // namespace marrow::workbench
