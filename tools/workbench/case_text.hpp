// SPDX-License-Identifier: Apache-2.0
#pragma once
// A draft's document as the files of a case (docs/case.md).
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "workbench/opened_folder.hpp"

namespace marrow::workbench {

/// The future content of a case's folder. `document`: the draft's, with paths relative to the case's folder.
struct PlannedCase {
  struct File {
    std::filesystem::path from;  ///< a file, or the folder of a series
    std::string name;            ///< its path in the case's folder
    bool is_new = false;         ///< `from` is outside the case's folder and will be copied
  };
  nlohmann::json document;
  std::vector<File> files;
};

/// Files outside the case's folder get a name that is free there; if the folder already has the same file, that one is
/// used. Throws Error with everything that is missing.
PlannedCase plan_case(const OpenedFolder& folder, const std::string& case_path, nlohmann::json document);

/// Makes the paths of a document, which are relative to the case's folder, relative to the opened folder.
void put_below(nlohmann::json& document, const std::string& case_path);

/// The text of case.yaml.
std::string case_yaml(const PlannedCase& plan);

/// The text of landmarks.yaml; empty if no landmark has a place in the CT. A landmark without a fragment belongs to the
/// only fragment that is registered; throws Error if there are several.
std::string landmarks_yaml(const nlohmann::json& document);

/// The landmarks in a landmarks.yaml, as in a document: [{name, fragment, model_mm, pixels, tracked_mm}].
nlohmann::json landmarks_of_file(const std::filesystem::path& file);

}  // namespace marrow::workbench
