// SPDX-License-Identifier: Apache-2.0
#pragma once
// The record of a run, read from its folder. No plugin is needed, so runs of plugins that no longer exist can be read
// too.
#include <filesystem>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <string>
#include <vector>

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

// The amount by which two values differ, in terms of the field: degrees and mm, figures of merit, samples.

struct Amount {
  std::vector<std::string> lines;                   ///< for people
  nlohmann::json facts = nlohmann::json::object();  ///< for scripts
};

/// For two items of a type that all plugins share. `lines` is empty if the type is another one, or if the types differ.
Amount amount_of(const Value& before, const Value& now);

/// For values that are known only as bytes. `what` names the bytes in the text.
Amount amount_of_bytes(const std::string& before, const std::string& now, const std::string& what);
/// The same for two files, which may be larger than the memory.
Amount amount_of_files(const std::filesystem::path& before, const std::filesystem::path& now);

// The values that runs computed, as far as they still exist.

/// One value of one run, and where it can be found.
struct ValueOfRun {
  std::string key;
  std::filesystem::path file;  ///< file below outputs/; empty if the run wrote none
  std::string uses;            ///< the node that made it
};

class KnownValues {
 public:
  /// Keeps a value that a run in this process computed, with all its items.
  void add(const Value& value);
  /// The amount by which two values differ. The text says if it comes from files, or if only the keys are known.
  Amount amount(const ValueOfRun& before, const ValueOfRun& now);

 private:
  std::optional<Value> find(const std::string& key);
  std::optional<std::string> packed(const Value& value, const std::string& uses);
  std::optional<Amount> amount_of_values(const Value& before, const Value& now, const ValueOfRun& made_before,
                                         const ValueOfRun& made_now);

  std::map<std::string, Value> held_;
  Store store_;
  std::optional<std::map<std::string, Digest>> entries_;  ///< entries of the store, by the keys of their outputs
  std::unique_ptr<Catalogue> catalogue_;  ///< made when the first value with a plugin's own type is found
};

// Finds the nodes that have different results in two runs, and why.

/// Something that a node got in one run and not in the other.
struct Change {
  std::string what;  ///< uses, plugin, option, content, seed, wire, unknown
  std::string node;  ///< the node that it belongs to
  std::string name;  ///< name of the option or of the input
  std::string before, now;
  std::string text;  ///< "option 'high' is 80, was 75"
};

/// A node whose results differ although the data from other nodes do not differ.
struct Root {
  const RecordedNode* before;
  const RecordedNode* now;
  std::vector<Change> why;
};

struct RunDifference {
  std::vector<Root> roots;                  ///< in the pipeline's order; the runs begin to differ at the first one
  std::vector<std::string> in_consequence;  ///< nodes that differ because a node before them differs
  std::vector<Change> others;               ///< changes of nodes that do not explain a root
  std::vector<std::string> only_before, only_now;
  std::vector<Change> rebuilt;  ///< plugins that both runs used in different builds
  std::size_t same = 0;         ///< number of nodes with the same result in both runs

  bool is_none() const { return roots.empty() && only_before.empty() && only_now.empty(); }
};

RunDifference difference_of(const RunRecord& before, const RunRecord& now);

// All differences between two runs, for people and for scripts.

inline constexpr const char *kIsNotThere = "it is not there", *kWasNotThere = "it was not there";

struct ItemDifference {
  std::string place;  ///< the item's place along the axes; empty outside lists
  std::string key_before, key_now;
  Amount amount;
};

/// An output of a node or of the run.
struct OutputDifference {
  std::string name;
  std::vector<ItemDifference> items;
  std::vector<std::string> notes;  ///< for example: it could not be written in one run
  std::size_t same = 0;            ///< number of items that are the same

  bool is_none() const { return items.empty() && notes.empty(); }
};

struct Findings {
  RunRecord before, now;
  RunDifference difference;               ///< refers to nodes of both runs
  std::vector<OutputDifference> first;    ///< differing outputs of the first root
  std::vector<OutputDifference> results;  ///< all outputs of the run
  std::vector<std::string> damaged;       ///< files of either run that are missing or changed since it wrote them

  bool identical() const;
  Findings(RunRecord before, RunRecord now);
  Findings(const Findings&) = delete;
  Findings(Findings&&) = default;
};

Findings find_differences(RunRecord before, RunRecord now, KnownValues& values);

void print(const Findings& findings);
nlohmann::json json_of(const Findings& findings);

}  // namespace marrow::cli
