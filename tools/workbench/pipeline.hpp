// SPDX-License-Identifier: Apache-2.0
#pragma once
// What the page "Pipeline" shows of a file, and the file's pipeline with the page's inputs.
#include <optional>

#include "workbench/workbench.hpp"

namespace marrow::workbench {

/// Adds to {file, text} what the file says: {faults: [{file, line, column, message, hint}], faults_text, inputs, graph,
/// nodes, outputs}. With faults, `graph` is null and `nodes` says only what is written.
void describe_pipeline(nlohmann::json& state, const Workbench& workbench);

/// The arguments that the page's form gives: {name: text}. Texts of inputs of type path are relative to the opened
/// folder; an empty text counts as not given. Throws Error for a path that leads out of the folder.
PipelineArguments arguments_of_form(const std::string& file, const nlohmann::json& inputs, const Workbench& workbench);

/// A pipeline that can be run, with these inputs. Throws Error with all faults.
Pipeline pipeline_of_form(const std::string& file, const nlohmann::json& inputs, const Workbench& workbench);

/// "cd FOLDER && marrow run FILE name=value".
std::string command_of_form(const std::string& command, const std::string& file, const nlohmann::json& inputs,
                            const Workbench& workbench);

/// The faults of the file with these overrides, each with its hint.
std::vector<std::string> faults_of(const std::string& file, const std::vector<Override>& overrides,
                                   const Workbench& workbench);

// Pipeline files that are being edited: their text, and the changes that can be undone. A change of the file by another
// program is a change like any other.

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

// marrow's own pipelines, which a person copies into the opened folder and changes there.

/// [{name, help, inputs}] of the families that a person runs, sorted by name: "femur/femur-best". `inputs` are names.
/// Empty if they are not installed.
nlohmann::json own_pipelines();

/// Writes a copy of one into the opened folder, as `marrow new pipeline` does, and returns its path there. Throws Error
/// if there is no such pipeline, or if a file of its name exists already.
std::string copy_of_own_pipeline(const std::string& name, const OpenedFolder& folder);

// The inputs that a person gave to each pipeline last, in .marrow/inputs.json of the opened folder. The page offers
// them again. A browser could not keep them: each start of the server has another port, and so another place for it.

class KeptInputs {
 public:
  explicit KeptInputs(const OpenedFolder& folder) : folder_(folder) {}
  /// {name: text}; empty if nothing is kept, or if the file is damaged.
  nlohmann::json of(const std::string& file) const;
  /// What cannot be written is not kept.
  void keep(const std::string& file, const nlohmann::json& inputs);

 private:
  nlohmann::json all() const;

  const OpenedFolder& folder_;
  mutable std::mutex mutex_;
};

// Changes one thing in the text of a pipeline. Comments, layout and all other lines stay as they are.

struct PipelineEdit {
  enum class What { option, wire, uses, may_fail };
  What what = What::option;
  std::string node;
  std::string name;                  ///< of the option or of the input
  std::optional<std::string> value;  ///< as YAML on one line; nothing: remove the entry

  /// What --set calls it: "edges.low", "edges.in.view", "edges.uses".
  std::string key() const;
  /// For people: "edges.low = 60", "edges.low removed".
  std::string in_words() const;
};

/// The text after the edit. Like --set, another `uses` also removes the options of the old node. Throws Error if the
/// node does not exist, the file has anchors, or the edited text would not read back as the same pipeline with only
/// this change.
std::string edited_text(const std::string& text, const PipelineEdit& edit);

/// A YAML scalar that reads back as this text: plain if possible, otherwise in double quotes.
std::string yaml_scalar(const std::string& text);

// Plans and runs a pipeline of the opened folder, as `marrow plan` and `marrow run` do, and shows the outputs of nodes.

/// The last run, whose values are still in memory.
struct LastRun {
  std::string revision;  ///< of the pipeline's file
  nlohmann::json inputs;
  Pipeline pipeline;
  RunResult result;
};

/// Keeps the last run. Safe to use from several threads.
class LastRuns {
 public:
  void keep(const std::string& file, std::shared_ptr<const LastRun> run);
  /// Null unless the last run was of this file, revision and inputs.
  std::shared_ptr<const LastRun> find(const std::string& file, const std::string& revision,
                                      const nlohmann::json& inputs) const;

 private:
  mutable std::mutex mutex_;
  std::string file_;
  std::shared_ptr<const LastRun> run_;
};

/// {nodes: {id: {state, text, seconds}}, cached, to_run, may_run, seconds}. `state` is cached, function, runs, depends
/// or not_needed. Throws Error with the faults of the pipeline.
nlohmann::json plan_of(const Pipeline& pipeline, const Workbench& workbench);

/// Runs it into a new folder runs/NAME of the opened folder. Returns {folder, status, seconds, verdicts, faults, nodes:
/// {id: {status, reason, seconds}}}. The job gets the run's events.
nlohmann::json run_into_folder(std::shared_ptr<LastRun> run, const PipelineArguments& arguments,
                               const Workbench& workbench, Job& job);

/// The outputs of a node for the page: [{name, type, help, left_out, items: [{place, parts: [{kind, ...}]}]}]. Takes
/// them from `last` if it has them, otherwise from the store. Throws Error if they have not been computed yet.
nlohmann::json outputs_of_node(const Pipeline& pipeline, const std::string& node, const LastRun* last,
                               const Workbench& workbench, Job& job);

}  // namespace marrow::workbench
