// SPDX-License-Identifier: Apache-2.0
#pragma once
// Runs and comparisons of the opened folder, as the page "Results" lists and compares them.
#include <nlohmann/json.hpp>
#include <string>

#include "workbench/opened_folder.hpp"

namespace marrow::workbench {

/// [{folder, kind, name, when, status, seconds, verdicts, figures, has_report, fault}] with the newest first. `kind` is
/// run or comparison. `fault` says why nothing else is known; otherwise it is missing.
nlohmann::json list_results(const OpenedFolder& folder);

/// What `marrow diff` finds between two runs, with the pictures that both have: {findings, figures, pictures, names}.
/// Throws Error if one of them is no run.
nlohmann::json compare_results(const OpenedFolder& folder, const std::string& first, const std::string& second);

/// The file report.html of a run or comparison. That of a run is made if it is not there. Throws Error for a comparison
/// without one.
std::filesystem::path report_of(const OpenedFolder& folder, const std::string& result);

}  // namespace marrow::workbench
