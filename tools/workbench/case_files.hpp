// SPDX-License-Identifier: Apache-2.0
#pragma once
// A draft's document as the files of a case (docs/case.md).
#include <functional>
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

// Writes a case's folder so that nothing is lost, even if an interruption comes in the middle.

struct PlannedCase;

/// Whether two files hold the same bytes, or two folders the same names with the same bytes. False if one cannot be
/// read.
bool is_same_content(const std::filesystem::path& a, const std::filesystem::path& b);

/// Puts the whole case into a hidden folder inside `place` and checks it there. Only then moves what is new to its
/// place; landmarks.yaml and case.yaml come last and replace older ones. No other file is replaced or removed. `check`
/// gets the hidden folder and throws if the case is not good. After any exception, the old case is unchanged.
void write_case_files(const std::filesystem::path& place, const PlannedCase& plan, const std::string& case_text,
                      const std::string& landmarks_text,
                      const std::function<void(const std::filesystem::path&)>& check);

// Writes a YAML file again and keeps the comments of people.

struct KeptText {
  std::string text;
  std::vector<std::string> lost;  ///< comments of the older text that are not in `text`, each from its '#'
};

/// A text with the content of `newer`. Parts with the same content in both are taken from `older`, with their comments,
/// layout and order. Maps are compared key by key. In lists of maps with a `name`, the items at the beginning of both
/// are compared. A transform may be a rotation and a shift in one text and a matrix in the other. If `older` cannot be
/// changed part by part (it is not YAML, or has anchors), the result is `newer` below the first comments of `older`.
KeptText with_comments_of(const std::string& older, const std::string& newer);

}  // namespace marrow::workbench
