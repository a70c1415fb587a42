// SPDX-License-Identifier: Apache-2.0
#pragma once
// Slurm: arrays of tasks that do the chunks of a plan, and a job that gathers their rows.
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "cluster/plan.hpp"
#include "cluster/profile.hpp"

namespace marrow::cli {

/// What was given to Slurm: FOLDER/slurm.json.
struct Submission {
  struct Array {
    std::string job;
    std::vector<std::string> chunks;  ///< by the task's number
  };
  std::string plan;
  std::int64_t tries = 0;  ///< how often cells were submitted
  std::vector<Array> arrays;
  std::string gather;        ///< the job that makes tables and report
  bool is_gathered = false;  ///< that job is done
};
std::optional<Submission> read_submission(const std::filesystem::path& folder);
void write_submission(const std::filesystem::path& folder, const Submission& submission);

/// Submits the chunks that have no rows yet, cases first, and a job that gathers. `profile_file` may be empty. Throws
/// Error with what sbatch said if it refuses; nothing stays submitted then.
Submission submit(const ClusterPlan& plan, const ClusterProfile& profile, const std::filesystem::path& profile_file,
                  std::int64_t tries_before);

/// The states of tasks that Slurm still knows, by "JOB_TASK": RUNNING, TIMEOUT, ... Ended tasks are known for some
/// minutes only, or for long if the cluster keeps accounts.
std::map<std::string, std::string> states_of(const Submission& submission);
/// Why the chunks without rows have none, in words, by the chunk's name.
std::map<std::string, std::string> reasons_of(const Submission& submission);
/// Whether a job is waiting or running. Nothing if Slurm does not answer.
std::optional<bool> is_alive(const std::string& job);
/// Why the cluster holds a task back until somebody releases it, in its words. Empty if it holds none.
std::string held_back(const Submission& submission);
/// Ends what is waiting or running.
void cancel(const Submission& submission);

}  // namespace marrow::cli
