// SPDX-License-Identifier: Apache-2.0
#pragma once
// Cases that are being made. Each change is written at once, so that a crash or a closed tab loses nothing, and can be
// undone. The drafts are in .marrow/drafts of the opened folder: a case's own folder holds only the case.
#include <map>
#include <mutex>
#include <vector>

#include "workbench/opened_folder.hpp"

namespace marrow::workbench {

/// A draft's document has the keys of case.yaml (docs/case.md), with these differences: paths are relative to the
/// opened folder; `ct` is always a map or null, and `surface` of a fragment a map; the poses `start` are 4 x 4
/// matrices; and there are `landmarks: [{name, fragment, model_mm, pixels: {view: [u, v]}, tracked_mm}]`, where only
/// the name is required.
class Drafts {
 public:
  explicit Drafts(const OpenedFolder& folder) : folder_(folder) {}

  /// {case, revision, document, undo, redo, is_saved}: `undo` and `redo` name the change that they would undo or redo,
  /// or are null. A case without a draft begins with its case.yaml, or empty. Throws Error if either cannot be read: a
  /// draft's file may be damaged, and an empty case in its place would look as if all was lost.
  nlohmann::json open(const std::string& case_path);
  /// [{case, changed, changes, fault}]: the drafts with changes that are not saved, the newest first. `changed` is a
  /// time in UTC, `changes` the number that undo reaches. `fault` says why a draft cannot be opened; otherwise it is
  /// missing.
  nlohmann::json unsaved();
  /// Removes the draft; the case's own files stay. Throws Error if there is none.
  void throw_away(const std::string& case_path);
  /// These change the draft, undo or redo a change, and return what open() now does. They throw Conflict unless
  /// `revision` is the newest, and Error if the change cannot be written; then nothing has changed.
  nlohmann::json change(const std::string& case_path, int revision, const std::string& what, nlohmann::json document);
  nlohmann::json step(const std::string& case_path, int revision, bool is_redo);
  /// Call this after the document of this revision was written as a case.
  nlohmann::json mark_saved(const std::string& case_path, int revision);

 private:
  struct Step {
    std::string what;
    nlohmann::json document;
  };
  struct Draft {
    std::filesystem::path file;
    std::vector<Step> steps;         ///< the first is the beginning
    std::size_t at = 0;              ///< the step that is shown
    int revision = 0;                ///< the number of changes
    int saved = -1;                  ///< the step that case.yaml holds; -1: none
    std::uintmax_t bytes = 0;        ///< size of the file; another size means that another program changed it
    std::uintmax_t whole_bytes = 0;  ///< of its whole lines: a crash may leave half a line behind them
  };
  static Draft read(const std::filesystem::path& file);
  Draft& find(const std::string& case_path);
  Draft& find(const std::string& case_path, int revision);
  static void apply(Draft& draft, const nlohmann::json& line);
  static void append(Draft& draft, const nlohmann::json& line);
  nlohmann::json shown(const std::string& case_path, const Draft& draft) const;

  const OpenedFolder& folder_;
  std::mutex mutex_;
  std::map<std::string, Draft> drafts_;
};

/// The document of a case's folder, with paths relative to the opened folder. An empty one if there is no case.yaml.
nlohmann::json document_of_case(const OpenedFolder& folder, const std::string& case_path);

}  // namespace marrow::workbench
