// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <atomic>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "marrow/runtime/run/profile.hpp"
#include "marrow/runtime/store/store.hpp"

namespace MARROW_EXPORT marrow {

/// What a run reports while it is running. `item` names the place along the mapped axes ("lateral", "distal/final").
/// `seconds` is the time of a call; for a cached call, the time that it took when its result was made. `waiting`:
/// another run is making the same result; the event has a text only if the wait is longer than 5 s. `waited`: the wait
/// is over and the call goes on. `failed`: of level warning if the node may fail, else of level error.
struct RunEvent {
  enum class Kind { started, progress, finished, failed, skipped, message, warning, cached, waiting, waited };
  Kind kind = Kind::message;
  std::string node, item, text;
  double fraction = 0;
  double seconds = 0;
  LogLevel level = LogLevel::info;  ///< level of a message, a warning or a failure
};

/// Limits of one call that reads files in its own process. 0 means a limit that depends on the size of the files.
struct FileLimits {
  double memory_mb = 0;
  double seconds = 0;  ///< processor time
};

struct FailedCall;
class CallKeys;
struct Replay;

struct RunSettings {
  std::uint64_t seed = 1;
  int threads = 0;  ///< 0 = one per hardware thread
  const std::atomic<bool>* cancelled = nullptr;
  std::function<void(const RunEvent&)> observer;  ///< called by one thread at a time
  /// Outputs of nodes that are already known, by the name of the node. These nodes are not run, and neither are nodes
  /// that only they need. A program that has the model and the images in memory passes new ones this way.
  std::map<std::string, std::vector<Value>> given;
  /// Results are looked up here before a node is called, and kept here for later runs. nullptr: nothing is kept.
  const Store* store = nullptr;
  /// Nodes that are called even if the store has their results; for measuring time.
  std::set<std::string> made_anew = {};
  /// Nodes whose results others may want: these are looked up in the shared store, and kept there if it is worth it.
  /// Nothing: all nodes.
  std::optional<std::set<std::string>> wanted_by_others = {};
  bool remember = true;  ///< store what each node's result was made from, so that the next plan can say what changed
  FileLimits file_limits = {};
  std::string within = {};  ///< the node and the pass whose body is run, as "track/0007"; empty for a whole pipeline
  std::function<void(const FailedCall&)> on_failed_call = {};  ///< called by the thread that made the call
  CallKeys* call_keys = nullptr;                               ///< receives the keys of all results but functions
  const Replay* replay = nullptr;  ///< makes one call of an earlier run again, and only what that needs
  ProfilePlace profile = {};       ///< where the time of each call is noted; at first nowhere
};

struct PassesRecord;

/// What happened to one node in a run.
struct NodeRecord {
  /// `failed_alone`: it failed, and it may (PipelineNode::may_fail). This is a warning and no fault of the run.
  enum class Status { not_needed, done, skipped, failed, not_run, cancelled, failed_alone };
  Status status = Status::not_needed;
  std::string reason;          ///< why it is not done
  int stopped = 0;             ///< if it failed or was cancelled: how many nodes were not run because of it
  double start_s = 0;          ///< since the start of the run
  double seconds = 0;          ///< wall time of all its calls together
  int calls = 0;               ///< how often its function was called: once per item, but only once for equal recipes
  int cached = 0;              ///< calls whose results were read back from the store
  double cached_seconds = 0;   ///< time that the cached calls took when they were made
  double peak_memory_mb = 0;   ///< largest memory of the whole process while the node ran
  std::vector<Value> outputs;  ///< in the order of the node's outputs
  /// By option: digest of the content that its paths named when they were read; zero if missing or unreadable.
  std::map<std::string, Digest> files;
  std::shared_ptr<PassesRecord> passes;  ///< of a node with a body, if a pass was begun

  /// Whether no item of it was begun because an earlier node failed or the run was stopped.
  bool was_stopped() const;
};
const char* status_name(NodeRecord::Status status);
/// "3 nodes were not run because of it".
std::string not_run_text(int nodes);

/// What happened to the body of a node.
struct PassesRecord {
  struct Pass {
    std::string name;
    NodeRecord::Status status = NodeRecord::Status::done;
    std::string reason;  ///< why it is not done
    double seconds = 0;
  };
  std::vector<Pass> passes;
  std::string end;  ///< why there was no further pass, in words; empty if all items had theirs
  /// What the passes were given, by Repetition::given: lists over the passes that have keys but no data.
  std::vector<Value> given;
  /// Of all passes together, in the order of Repetition::alone. Their outputs are such lists, too.
  std::vector<NodeRecord> nodes;
};

struct RunResult {
  std::vector<NodeRecord> nodes;  ///< in the order of Pipeline::nodes
  double seconds = 0;
  bool failed() const;
  bool cancelled() const;
};

/// Runs the nodes that the pipeline's outputs need. Independent nodes run in parallel on one thread pool. If a node
/// fails, the nodes that depend on it are not run, and the others go on. If the node may fail, its outputs are absent
/// instead: a node that can do without them runs, and one that needs them fails too. The same pipeline and seed give
/// the same bytes with any number of threads. Throws Error if no thread can be started.
RunResult run_pipeline(const Pipeline& pipeline, const Catalogue& catalogue, const RunSettings& settings);

/// What a run would do with one node.
struct PlannedNode {
  enum class What { not_needed, cached, function, runs, depends };
  What what = What::not_needed;
  int calls = 0, calls_to_make = 0;
  std::string why;                  ///< why it runs
  std::set<std::string> waits_for;  ///< for `depends`: it runs unless the results of these nodes stay the same
  double seconds = 0;               ///< time that the calls to make took in the last run; 0 if not known
};

/// What run_pipeline() would do, in the order of Pipeline::nodes. Calls no node. `settings.store` must be given.
std::vector<PlannedNode> plan_pipeline(const Pipeline& pipeline, const Catalogue& catalogue,
                                       const RunSettings& settings);

/// The value that a reference names in a result; absent if it could not be made. Throws Error if the reference names an
/// item that its list does not have.
Value value_of(const RunResult& result, const Reference& source);

}  // namespace marrow
