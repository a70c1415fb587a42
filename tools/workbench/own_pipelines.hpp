// SPDX-License-Identifier: Apache-2.0
#pragma once
// marrow's own pipelines, which a person copies into the opened folder and changes there.
#include "workbench/opened_folder.hpp"

namespace marrow::workbench {

/// [{name, help, inputs}] of the families that a person runs, sorted by name: "femur/femur-best". `inputs` are names.
/// Empty if they are not installed.
nlohmann::json own_pipelines();

/// Writes a copy of one into the opened folder, as `marrow new pipeline` does, and returns its path there. Throws Error
/// if there is no such pipeline, or if a file of its name exists already.
std::string copy_of_own_pipeline(const std::string& name, const OpenedFolder& folder);

}  // namespace marrow::workbench
