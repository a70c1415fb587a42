// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <atomic>
#include <cstdint>
#include <functional>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "marrow/runtime/catalogue.hpp"
#include "marrow/runtime/pipeline.hpp"
#include "marrow/runtime/store.hpp"

namespace marrow {

/// What a run reports while it goes on. `seconds`: that a call took; of a cached one, when it was made. `item` names
/// the place along the mapped axes ("lateral", "distal/final"). `waiting`: another run is making the same result, with
/// a text once that takes seconds; `waited`: that is over, and the call goes on.
struct RunEvent {
  enum class Kind { started, progress, finished, failed, skipped, message, warning, cached, waiting, waited };
  Kind kind = Kind::message;
  std::string node, item, text;
  double fraction = 0;
  double seconds = 0;
  LogLevel level = LogLevel::info;  ///< of a message or a warning
};

/// What one call that reads a file may use, in its own process. 0 = by the file's size.
struct FileLimits {
  double memory_mb = 0;
  double seconds = 0;  ///< of processor time
};

struct RunSettings {
  std::uint64_t seed = 1;
  int threads = 0;  ///< 0 = as many as the machine has
  const std::atomic<bool>* cancelled = nullptr;
  std::function<void(const RunEvent&)> observer;  ///< called by one thread at a time
  /// Outputs of nodes that are already known, by the node's name: they and what only they need are not run. A program
  /// that holds the model and the images in memory registers new ones this way.
  std::map<std::string, std::vector<Value>> given;
  /// Where results are looked up before a node is called, and kept for later runs. None: nothing is kept.
  const Store* store = nullptr;
  std::set<std::string> made_anew =
      {};                ///< nodes that are called although the store may have their results; for measuring time
  bool remember = true;  ///< what each node came to, so that the next run's plan can say what changed
  FileLimits file_limits = {};
};

/// How one node fared.
struct NodeRecord {
  enum class Status { not_needed, done, skipped, failed, not_run, cancelled };
  Status status = Status::not_needed;
  std::string reason;          ///< of anything but done
  int stopped = 0;             ///< of one that failed or was cancelled: the nodes that were not run because of it
  double start_s = 0;          ///< after the run's start
  double seconds = 0;          ///< of its calls together, wall time
  int calls = 0;               ///< how often its function was called: once per item, once where recipes are the same
  int cached = 0;              ///< calls whose results were read back from the store
  double cached_seconds = 0;   ///< that those calls took when they were made
  double peak_memory_mb = 0;   ///< most memory of the whole process while it ran
  std::vector<Value> outputs;  ///< in the order of the node's outputs
  std::map<std::string, Digest>
      files;  ///< content of what its options named when it was read; zero: not there or not to be read

  /// No item of it was begun, because a node before it failed or the run was stopped.
  bool was_stopped() const;
};
const char* status_name(NodeRecord::Status status);
/// "3 nodes were not run because of it".
std::string not_run_text(int nodes);

struct RunResult {
  std::vector<NodeRecord> nodes;  ///< in the order of Pipeline::nodes
  double seconds = 0;
  bool failed() const;
  bool cancelled() const;
};

/// Evaluates what the pipeline's outputs need, independent nodes in parallel on one pool. A node that fails leaves the
/// others going; what depends on it is not run. The same pipeline and seed give the same bytes at any number of
/// threads.
RunResult run_pipeline(const Pipeline& pipeline, const Catalogue& catalogue, const RunSettings& settings);

/// What a run would do with one node.
struct PlannedNode {
  enum class What { not_needed, cached, function, runs, depends };
  What what = What::not_needed;
  int calls = 0, calls_to_make = 0;
  std::string why;                  ///< it runs
  std::set<std::string> waits_for;  ///< of `depends`: it runs unless these come out unchanged
  double seconds = 0;               ///< that the calls to make took the last time; 0 where that is not known
};

/// What run_pipeline() would do, in the order of Pipeline::nodes. Calls no node. `settings.store` must be given.
std::vector<PlannedNode> plan_pipeline(const Pipeline& pipeline, const Catalogue& catalogue,
                                       const RunSettings& settings);

/// The value that a reference means in a result; absent where it could not be made. Throws Error for a name that a list
/// does not have.
Value value_of(const RunResult& result, const Reference& source);

}  // namespace marrow
