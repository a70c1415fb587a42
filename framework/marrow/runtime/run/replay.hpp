// SPDX-License-Identifier: Apache-2.0
#pragma once
// How a run, or one call of it alone, is made again.
#include <cstdint>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "marrow/runtime/run/executor.hpp"

namespace MARROW_EXPORT marrow {

/// A call of a node that failed, or could not be made.
struct FailedCall {
  const PipelineNode& node;
  std::string within;  ///< as RunSettings::within
  std::string item;    ///< its place along the mapped axes
  std::string path;    ///< the node, after the nodes whose bodies it is in: "track/edges"
  std::string place;   ///< the passes and the item: "0007/lateral"
  std::string reason;
  std::uint64_t seed = 0;            ///< of its random numbers
  const std::vector<Value>& inputs;  ///< empty if they could not be made
};

/// Under which keys a run looked for the results of its calls: by {within, node, item}.
using KeysOfCalls = std::map<std::vector<std::string>, Digest>;

/// Collects such keys. Safe to use from several threads.
class CallKeys {
 public:
  void note(const std::string& within, const std::string& node, const std::string& item, const Digest& key);
  KeysOfCalls all() const;

 private:
  mutable std::mutex mutex_;
  KeysOfCalls keys_;
};

/// A call to make again. Nothing else runs but what it needs, and of that what the store still has is read back.
struct Replay {
  struct Outcome {
    NodeRecord::Status status = NodeRecord::Status::done;
    std::string reason;  ///< why it is not done
    std::vector<Value> outputs;
    double seconds = 0;
  };
  std::string within, node, item;     ///< as in FailedCall
  std::optional<std::uint64_t> seed;  ///< of its random numbers; nothing: as usual
  bool in_this_process = false;       ///< also if it is a node that parses files
  bool stops_before = false;          ///< raises SIGTRAP right before the call, for a debugger
  /// The results of the first run. They are read back even if a plugin has been rebuilt since.
  KeysOfCalls kept;
  std::function<void(const PipelineNode& node, const std::vector<Value>& inputs)> on_begin;
  /// Called if the call was made, or could not be made for a reason of its own.
  std::function<void(const PipelineNode& node, const Outcome& outcome)> on_end;

  /// Whether the call is in a run within `path` (RunSettings::within).
  bool leads_into(const std::string& path) const;
  /// From `kept`. What is the same in all passes was noted once, and is found for each of them.
  std::optional<Digest> kept_key(const std::string& run_within, const std::string& id, const std::string& place) const;
};

/// Makes the outputs of the replayed node, or those of the node whose body it is in, the only outputs of the pipeline
/// that is to be run with these settings. Returns false and changes nothing if the call is elsewhere. Throws Error if
/// the pipeline has no such node.
bool keep_only_replayed(Pipeline& pipeline, const RunSettings& settings);

/// The keyword of the text in a PNG file that holds a recipe.
inline constexpr const char* kRecipeKeyword = "marrow recipe";

struct RunRecipe {
  std::string version;  ///< of marrow
  std::uint64_t seed = 1;
  FileLimits file_limits;
  std::string pipeline;  ///< resolved_yaml()

  /// The pipeline as a file that `marrow run` takes. Comments above it say the version, and what `marrow run` must be
  /// given besides the file: "--seed 3", and limits for reading files if there were some. It holds no times, no host,
  /// and not the way in which values were given, so a run of this file has the same recipe. What lies in the user's
  /// home folder is written as $env:HOME/..., so the text does not name the user.
  std::string text() const;
};

/// The recipe of a run by this version of marrow.
RunRecipe recipe_of_run(const Pipeline& pipeline, const RunSettings& settings);

}  // namespace marrow
