// SPDX-License-Identifier: Apache-2.0
// Which files a pipeline would miss.
#include "missing_files.hpp"

#include <algorithm>
#include <filesystem>

#include "marrow/base/printable.hpp"
#include "marrow/runtime/pipeline/named_files.hpp"
#include "marrow/runtime/run/executor.hpp"

namespace marrow::cli {
namespace {

namespace fs = std::filesystem;

/// What lies in the folder of a missing file and has nearly its name.
std::string nearest_in_folder(const fs::path& missing) {
  std::error_code error;
  fs::path folder = missing.parent_path();
  if (!fs::is_directory(folder, error)) {
    while (folder.has_relative_path() && !fs::is_directory(folder, error)) folder = folder.parent_path();
    return "the last folder on the way that there is: " + folder.string();
  }
  std::vector<std::string> names;
  for (fs::directory_iterator at(folder, error), end; !error && at != end; at.increment(error))
    names.push_back(at->path().filename().string());
  return suggestion(missing.filename().string(), names);
}

/// Adds the paths in the node's own options that lead nowhere. Returns whether there are none.
bool has_its_files(const PipelineNode& node, Diagnostics& faults) {
  bool all = true;
  for (std::size_t option = 0; option < node.options.size(); ++option)
    for (const std::string& path : paths_of(node, option)) {
      std::error_code error;
      if (path.empty() || fs::exists(path, error)) continue;
      all = false;
      const Place& written = node.option_places[option];
      faults.add(written.file.empty() ? node.place : written,
                 "node " + in_quotes(node.id) + " would read " + path + ", which is not there",
                 nearest_in_folder(path));
    }
  return all;
}

/// Calls a node that needs no other one. Adds what it says if it fails.
void call_alone(const PipelineNode& node, const Pipeline& pipeline, const Catalogue& catalogue, Diagnostics& faults) {
  Pipeline alone;
  alone.name = pipeline.name;
  alone.file = pipeline.file;
  alone.nodes = {node};
  for (std::size_t i = 0; i < node.info.outputs.size(); ++i)
    alone.outputs.push_back({node.info.outputs[i].name, {node.info.outputs[i].name, node.place, 0, int(i), {}}});
  const NodeRecord called = run_pipeline(alone, catalogue, {}).nodes[0];
  if (called.status == NodeRecord::Status::failed)
    faults.add(node.place, "node " + in_quotes(node.id) + ": " + called.reason);
}

void add_faults(const Pipeline& pipeline, const Catalogue& catalogue, bool inputs_are_given, Diagnostics& faults) {
  const std::vector<bool> needed = pipeline.needed();
  for (std::size_t i = 0; i < pipeline.nodes.size(); ++i) {
    const PipelineNode& node = pipeline.nodes[i];
    if (!needed[i] || node.may_fail || node.stands_for_input) continue;
    if (node.repetition) add_faults(node.repetition->body, catalogue, inputs_are_given, faults);
    const bool has_all = has_its_files(node, faults);
    const std::vector<std::string>& traits = node.info.traits;
    if (has_all && inputs_are_given && node.wires.empty() &&
        std::find(traits.begin(), traits.end(), "names_files") != traits.end())
      call_alone(node, pipeline, catalogue, faults);
  }
}

}  // namespace

Diagnostics faults_of_files(const Pipeline& pipeline, const Catalogue& catalogue, bool inputs_are_given) {
  Diagnostics faults;
  add_faults(pipeline, catalogue, inputs_are_given, faults);
  return faults;
}

}  // namespace marrow::cli
