// SPDX-License-Identifier: Apache-2.0
#pragma once
// The record of a run, read from its folder. No plugin is needed, so runs of plugins that no longer exist can be read
// too.
#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "marrow/runtime/pipeline/pipeline.hpp"
#include "marrow/runtime/run/executor.hpp"

namespace marrow::cli {

/// A single value: its place along the axes ("distal/final"; empty outside lists) and its key. The key of an absent
/// value is zero.
struct RecordedItem {
  std::string place, key;
  bool is_absent() const { return key.find_first_not_of('0') == std::string::npos; }
};

struct RecordedOutput {
  std::string name, key;
  bool is_function = false;
  std::vector<RecordedItem> items;
};

struct RecordedWire {
  std::string text;                           ///< "case.views", "[a, b]"
  std::vector<std::string> from;              ///< the nodes that it comes from
  std::vector<std::string> from_pass_before;  ///< the nodes of the body that make it for the next pass
};

/// A node, or one of a node's body: its id is then "node/node of the body", and it is the sum of all passes.
struct RecordedNode {
  std::string id, uses, status, reason, library, build_id;
  bool random = false;
  std::map<std::string, std::string> options;
  std::string uses_place;                            ///< where what it uses is written: "femur.yaml:17"
  std::map<std::string, std::string> option_places;  ///< the same of each option that has not its default value
  std::map<std::string, RecordedWire> wires;         ///< by port
  std::map<std::string, std::string> input_keys;     ///< by port
  std::map<std::string, std::optional<std::string>>
      files;  ///< by option of type path: digest of the content that it names; nothing if that did not exist
  std::vector<RecordedOutput> outputs;

  bool is_in_body() const { return id.find('/') != std::string::npos; }
  bool has_failed() const { return status.starts_with("failed"); }  ///< also if it may ("failed alone")
  bool went_well() const { return status == "done" || status == "not needed"; }
  bool makes_data() const { return !data().empty(); }
  /// Its outputs that are not functions.
  std::vector<const RecordedOutput*> data() const;
};

struct RecordedResult {
  std::string name, fault;
  std::vector<RecordedItem> items;
  std::vector<std::string> files;     ///< paths in the folder, in the order of the items that are not absent
  std::vector<std::string> contents;  ///< digests of the files when they were written; empty if not known

  /// The file of an item. Empty if it is not known.
  std::filesystem::path file_of(const std::filesystem::path& folder, const std::string& place) const;
};

struct RunRecord {
  std::filesystem::path folder;
  std::string version;  ///< of marrow
  std::string pipeline, status, framework, cpu_level;
  std::uint64_t seed = 1;
  int threads = 0;
  FileLimits file_limits;
  PipelineArguments arguments;
  std::map<std::string, std::string> plugins;  ///< file name -> build id
  std::vector<RecordedNode> nodes;             ///< nodes of the run, in the pipeline's order
  std::map<std::string, std::size_t> places;   ///< index in `nodes`, by the node's id
  std::set<std::string> not_needed;            ///< ids of the nodes that did not run, because no output needs them
  std::vector<RecordedResult> results;

  const RecordedNode* find(const std::string& id) const;
};

/// A sentence for each file below outputs/ that is missing or was changed since the run wrote it.
std::vector<std::string> damaged_files(const RunRecord& run);

/// Throws Error if no run wrote the folder, or if its files cannot be read.
RunRecord read_run(const std::filesystem::path& folder);

}  // namespace marrow::cli
