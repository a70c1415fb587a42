// SPDX-License-Identifier: Apache-2.0
#pragma once
// What the folder of a run says of it. Read without any plugin, so that runs of plugins that are gone can be looked at
// too.
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "marrow/runtime/executor.hpp"
#include "marrow/runtime/pipeline.hpp"

namespace marrow::cli {

/// A single value: its place along the axes ("distal/final"; empty outside lists) and its key, which is zero for an
/// absent one.
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
  std::string text;               ///< "case.views", "[a, b]"
  std::vector<std::string> from;  ///< nodes
};

struct RecordedNode {
  std::string id, uses, status, reason, library, build_id;
  bool random = false;
  std::map<std::string, std::string> options;
  std::map<std::string, RecordedWire> wires;      ///< by port
  std::map<std::string, std::string> input_keys;  ///< by port
  std::map<std::string, std::optional<std::string>>
      files;  ///< content of what an option of type path names; nothing where it was not there
  std::vector<RecordedOutput> outputs;

  bool went_well() const { return status == "done" || status == "not needed"; }
  bool makes_data() const { return !data().empty(); }
  /// Its outputs that are no functions.
  std::vector<const RecordedOutput*> data() const;
};

struct RecordedResult {
  std::string name, fault;
  std::vector<RecordedItem> items;
  std::vector<std::string> files;     ///< below the folder, in the order of the items that are not absent
  std::vector<std::string> contents;  ///< of the files when they were written; empty where that is not known

  /// The file that holds an item; empty where it cannot be told.
  std::filesystem::path file_of(const std::filesystem::path& folder, const std::string& place) const;
};

struct RunRecord {
  std::filesystem::path folder;
  std::string pipeline, status, framework, cpu_level;
  std::uint64_t seed = 1;
  int threads = 0;
  FileLimits file_limits;
  PipelineArguments arguments;
  std::map<std::string, std::string> plugins;  ///< file name -> build id
  std::vector<RecordedNode> nodes;             ///< that took part, in the pipeline's order
  std::map<std::string, std::size_t> places;   ///< in it, by the nodes' ids
  std::vector<RecordedResult> results;

  const RecordedNode* find(const std::string& id) const;
};

/// The files below outputs/ that are not there any more, or not as the run wrote them, each in a sentence.
std::vector<std::string> damaged_files(const RunRecord& run);

/// Throws Error for a folder that no run has written, or whose files cannot be read.
RunRecord read_run(const std::filesystem::path& folder);

}  // namespace marrow::cli
