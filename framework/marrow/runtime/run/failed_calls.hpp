// SPDX-License-Identifier: Apache-2.0
#pragma once
// The folders of failed calls: failed/NODE/ITEM in the folder of a run.
#include <cstdint>
#include <filesystem>
#include <map>
#include <mutex>
#include <string>
#include <vector>

#include "marrow/runtime/run/replay.hpp"

namespace MARROW_EXPORT marrow {

/// Writes a folder for each failed call of a run, and at its end the keys of all results, so that a replay finds them.
class FailedCalls {
 public:
  /// Sets the hooks of the settings. The settings and this object must outlive the run.
  FailedCalls(const std::filesystem::path& run_folder, const Catalogue& catalogue, RunSettings& settings);
  FailedCalls(const FailedCalls&) = delete;
  FailedCalls& operator=(const FailedCalls&) = delete;

  void finish();
  std::vector<std::string> folders() const;

  /// A node of a body may fail in every pass. More folders of one node tell nothing new, and they take place.
  static constexpr int kMostOfNode = 10;
  /// A larger input is not written as a file: it may be a CT, and the store has it.
  static constexpr std::size_t kMostBytesOfInput = 16'000'000;

 private:
  void keep(const FailedCall& call);
  void write(const FailedCall& call);

  std::filesystem::path run_folder_;
  const Catalogue& catalogue_;
  std::uint64_t seed_;
  int threads_;
  FileLimits file_limits_;
  CallKeys keys_;
  mutable std::mutex mutex_;
  std::map<std::string, int> failures_;  ///< by the path of the node
  std::vector<std::string> folders_;
};

/// One item of an input of a failed call.
struct RecordedInput {
  std::string place;  ///< along the axes of a list; empty outside of lists
  std::string key;
  std::string file;  ///< relative to the folder of the call; empty if it was not written
};

/// A failed call, as its folder tells.
struct RecordedCall {
  std::filesystem::path run;  ///< the folder of the run
  std::string within, node, item, path, place, uses, reason;
  std::uint64_t seed = 1, call_seed = 0;
  int threads = 0;
  FileLimits file_limits;
  std::map<std::string, std::vector<RecordedInput>> inputs;  ///< by port
  bool has_inputs = false;                                   ///< whether the call got as far as that
  KeysOfCalls kept;
};

/// Throws Error if no run wrote the folder, or if its file is damaged.
RecordedCall read_failed_call(const std::filesystem::path& folder);

/// The items of an input, each with its key and without a file.
std::vector<RecordedInput> items_of_input(const Value& value);

}  // namespace marrow
