// SPDX-License-Identifier: Apache-2.0
#pragma once
// A draft's document as the files of a case (docs/case.md).
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "workbench/opened_folder.hpp"

namespace marrow::workbench {

/// What a case's folder will hold. `document` is that of the draft, with paths relative to the case's folder.
struct PlannedCase {
  struct File {
    std::filesystem::path from;  ///< a file, or the folder of a series
    std::string name;            ///< its path in the case's folder
    bool is_new = false;         ///< it lies elsewhere and is copied in
  };
  nlohmann::json document;
  std::vector<File> files;
};

/// Files that lie outside the case's folder get a name that nothing there has; if the same file is there already, that
/// one is taken. Throws Error with all that is missing.
PlannedCase plan_case(const OpenedFolder& folder, const std::string& case_path, nlohmann::json document);

/// The text of case.yaml.
std::string case_yaml(const PlannedCase& plan);

/// The text of landmarks.yaml; empty if there is no landmark with a place in the CT. One without a fragment belongs to
/// the only fragment that is registered; throws Error if there are several.
std::string landmarks_yaml(const nlohmann::json& document);

/// Of a landmarks.yaml the landmarks of a document: [{name, fragment, model_mm, pixels, tracked_mm}].
nlohmann::json landmarks_of_file(const std::filesystem::path& file);

}  // namespace marrow::workbench
