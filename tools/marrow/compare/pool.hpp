// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <atomic>
#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace marrow::cli {

/// Work for a worker process.
struct Job {
  nlohmann::json request;  ///< what the worker is asked
  std::string group;       ///< jobs of a group share results, so one worker takes them one after the other
  std::size_t number = 0;  ///< what it is to whoever gave it; the worker is not told
  int tries = 0;
  int refused = 0;  ///< how often the system granted it no process, though no other worker was there
};

struct PoolSettings {
  std::vector<std::string> command;  ///< that starts a worker
  int workers = 2;
  double time_limit_s = 600;      ///< of one job
  double memory_limit_mb = 4000;  ///< of one worker
  const std::atomic<bool>* cancelled = nullptr;
  std::function<void(const Job&, const std::string& where)> waits =
      {};  ///< told when a job waits for another process's result
};

/// How a job ended: the worker's answer, or why there is none.
struct JobEnd {
  nlohmann::json answer;
  std::string failed;
  int tries = 1;
};

/// The name under which a worker answers, instead of with what it made, why the system granted it no process or thread.
inline constexpr const char* kNoProcess = "no_process";

/// Gives the jobs to worker processes, each of which takes many. A worker that crashes, takes too long or too much
/// memory is replaced; its job is tried once more, alone, after all others. Where the system grants no further process,
/// the jobs are done by fewer workers; throws Error where not even one can do its job. `ended` is called by the calling
/// thread. Returns false when it was cancelled.
bool run_jobs(std::vector<Job> jobs, const PoolSettings& settings,
              const std::function<void(const Job&, const JobEnd&)>& ended);

}  // namespace marrow::cli
