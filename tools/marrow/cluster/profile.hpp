// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "marrow/base/diagnostics.hpp"

namespace marrow::cli {

/// Settings for a cluster, which it gets with each task.
struct ClusterProfile {
  std::string partition, account;    ///< empty = the cluster's default
  std::int64_t processors = 0;       ///< of one task; 0 = the cluster's default
  std::int64_t memory_mb = 0;        ///< of one task; 0 = the cluster's default
  std::int64_t minutes = 0;          ///< time limit of one task; 0 = the cluster's default
  std::vector<std::string> modules;  ///< loaded with `module load` before the task
  std::vector<std::string> setup;    ///< lines of shell before the task, for example `export MARROW_SHARED_CACHE=...`
  std::vector<std::string> options;  ///< further options of sbatch, as they are written there
  std::int64_t most_tasks = 1000;    ///< tasks of one array
  std::int64_t most_at_once = 0;     ///< tasks that may run at once; 0 = no limit
  std::int64_t tries = 2;            ///< how often a task is given to the cluster
  std::int64_t silence_s = 600;      ///< --wait ends if the cluster does not answer for so long
  std::int64_t ask_every_s = 10;     ///< how often --wait asks the cluster, which all its users ask
};

/// Reads a profile; all of its keys may be left out. Faults go to `diagnostics`, at their lines.
ClusterProfile read_profile(const std::filesystem::path& file, Diagnostics& diagnostics);

}  // namespace marrow::cli
