// SPDX-License-Identifier: Apache-2.0
#pragma once
// Slurm: arrays of tasks that do the chunks of a plan, and a job that gathers their rows.
#include <filesystem>
#include <map>
#include <optional>
#include <set>
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
  std::string lost;          ///< the cells that it found no row of, as Gathered::lost
};
std::optional<Submission> read_submission(const std::filesystem::path& folder);
void write_submission(const std::filesystem::path& folder, const Submission& submission);

/// Submits the chunks that have no rows yet, cases first, and a job that gathers. `profile_file` may be empty. Throws
/// Error with the words of sbatch if it refuses, or if Slurm could not write logs there. Then nothing stays submitted.
Submission submit(const ClusterPlan& plan, const ClusterProfile& profile, const std::filesystem::path& profile_file,
                  std::int64_t tries_before);

/// The states of tasks that Slurm still knows, by "JOB_TASK": RUNNING, TIMEOUT, ... Slurm knows ended tasks for some
/// minutes only, or for long if the cluster keeps accounts.
std::map<std::string, std::string> states_of(const Submission& submission);
/// Why the chunks without rows have none, in words, by the chunk's name.
std::map<std::string, std::string> reasons_of(const ClusterPlan& plan, const Submission& submission);

/// What Slurm says of the jobs that wait or run.
struct Queue {
  bool is_known = false;             ///< Slurm answered
  std::string fault;                 ///< its message if it did not answer
  bool has_gather = false;           ///< the job that gathers waits or runs
  std::string held;                  ///< why a job is held back until somebody releases it; empty if none is
  std::set<std::string> reasons;     ///< why jobs wait, in its words
  std::vector<std::string> running;  ///< tasks that run, each as "JOB_TASK"
};
Queue queue_of(const Submission& submission);
/// Ends one task, "JOB_TASK".
void end_task(const Submission& submission, const std::string& task);
/// Ends everything that waits or runs. Throws Error with the words of scancel if that fails.
void cancel(const Submission& submission);

}  // namespace marrow::cli
