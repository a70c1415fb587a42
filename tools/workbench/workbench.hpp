// SPDX-License-Identifier: Apache-2.0
#pragma once
// What all pages of `marrow open` work with, and how they run pipelines.
#include <map>
#include <string>
#include <vector>

#include "marrow/runtime/run/executor.hpp"
#include "workbench/drafts.hpp"
#include "workbench/jobs.hpp"
#include "workbench/opened_folder.hpp"
#include "workbench/server.hpp"

namespace marrow::workbench {

struct Workbench {
  explicit Workbench(const std::filesystem::path& opened) : folder(opened) {}
  /// The store; nullptr if no results can be kept in it.
  const Store* usable_store() const { return store.fault().empty() && store.prepare().empty() ? &store : nullptr; }

  OpenedFolder folder;
  Catalogue catalogue;
  Store store;
  Drafts drafts{folder};
  Jobs jobs;  ///< the last member: jobs use the others, and end first
};

/// A pipeline that a page runs: one of share/marrow/pipelines/workbench, or one of the user.
struct PipelineCall {
  std::filesystem::path file;
  PipelineArguments arguments = {};
  std::vector<std::string> only = {};                    ///< outputs; empty = all
  std::map<std::string, std::vector<Value>> given = {};  ///< as RunSettings::given
  bool keep = true;                                      ///< in the store
};

/// A node that a page calls alone, such as a reader. What it returns is not kept in the store.
struct NodeCall {
  std::string name;                                             ///< as read.image
  std::vector<std::pair<std::string, nlohmann::json>> options;  ///< a path is absolute
};

/// share/marrow/pipelines/workbench/NAME.yaml
std::filesystem::path workbench_pipeline(const std::string& name);

/// A value as text for `--set`: a JSON string or list, with '$' escaped.
std::string set_text(const nlohmann::json& value);

/// Runs it and returns its outputs; an output that could not be made is absent. The run's events go to the job, and
/// stopping the job stops it. Throws Error with all faults of the file, or with the reason of the first node that
/// failed.
std::map<std::string, Value> outputs_of(const PipelineCall& call, const Workbench& workbench, Job& job);
/// The same for a node; its outputs have the names that the node gives them.
std::map<std::string, Value> outputs_of(const NodeCall& call, const Workbench& workbench, Job& job);

/// The command that runs it in a shell.
std::string command_of(const PipelineCall& call);
/// The same for a node: the command runs workbench/node.yaml with it.
std::string command_of(const NodeCall& call);
/// "cd FOLDER && marrow COMMAND", with the opened folder.
std::string command_in_folder(const Workbench& workbench, const std::string& command);

/// Each adds the requests of one page to the server.
void add_shell(Server& server, Workbench& workbench);
void add_case_page(Server& server, Workbench& workbench);
void add_ct_page(Server& server, Workbench& workbench);
void add_pipeline_page(Server& server, Workbench& workbench);
void add_results_page(Server& server, Workbench& workbench);
void add_xray_page(Server& server, Workbench& workbench);
void add_place_page(Server& server, Workbench& workbench);

}  // namespace marrow::workbench
