// SPDX-License-Identifier: Apache-2.0
#pragma once
// Pipeline files that are being edited: their text, and the changes that can be undone. A change of the file by another
// program is a change like any other.
#include <functional>
#include <map>
#include <mutex>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "workbench/opened_folder.hpp"

namespace marrow::workbench {

class PipelineFiles {
 public:
  explicit PipelineFiles(const OpenedFolder& folder) : folder_(folder) {}

  /// {file, text, revision, undo, redo}: `undo` and `redo` name the change that they would undo or redo, or are null.
  /// The revision is the digest of the text. Throws Error if the file cannot be read.
  nlohmann::json open(const std::string& file);
  std::string revision(const std::string& file) const;
  /// Writes the text that `changed` makes of the present one, and returns what open() now returns. Throws Conflict
  /// unless the file is of this revision, and Error if it cannot be written; then nothing has changed.
  nlohmann::json change(const std::string& file, const std::string& revision, const std::string& what,
                        const std::function<std::string(const std::string&)>& changed);
  nlohmann::json undo(const std::string& file, const std::string& revision) { return step(file, revision, -1); }
  nlohmann::json redo(const std::string& file, const std::string& revision) { return step(file, revision, +1); }

 private:
  struct Step {
    std::string what, text;
  };
  struct History {
    std::vector<Step> steps;  ///< the first is the file as it was found
    std::size_t at = 0;       ///< the step that the file holds
  };
  History& find(const std::string& file);
  History& find(const std::string& file, const std::string& revision);
  nlohmann::json step(const std::string& file, const std::string& revision, int by);
  nlohmann::json shown(const std::string& file, const History& history) const;
  static void add(History& history, Step step);

  const OpenedFolder& folder_;
  std::mutex mutex_;
  std::map<std::string, History> histories_;
};

}  // namespace marrow::workbench
