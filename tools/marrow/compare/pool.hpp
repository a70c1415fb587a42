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
  nlohmann::json request;  ///< the request to the worker
  std::string group;       ///< jobs of a group share results, so one worker does them one after the other
  std::size_t number = 0;  ///< the caller's number for the job; the worker does not see it
  int tries = 0;
  int refused = 0;  ///< how often the system gave it no process although no other worker existed
};

struct PoolSettings {
  std::vector<std::string> command;  ///< command line that starts a worker
  int workers = 2;
  double time_limit_s = 600;      ///< for one job
  double memory_limit_mb = 4000;  ///< for one worker
  const std::atomic<bool>* cancelled = nullptr;
  std::function<void(const Job&, const std::string& where)> waits =
      {};  ///< called when a job waits for the result of another process
};

/// The end of a job: the worker's answer, or why there is none.
struct JobEnd {
  nlohmann::json answer;
  std::string failed;
  int tries = 1;
};

/// If the system gives a worker no process or thread, its answer is an object with this key and the reason.
inline constexpr const char* kNoProcess = "no_process";

/// Gives the jobs to worker processes. Each worker does many jobs. A worker that crashes, takes too long or uses too
/// much memory is replaced. Its job is tried once more, alone, after all others. If the system gives no further
/// process, fewer workers do the jobs. Throws Error if not even one worker can do its job. `ended` is called in the
/// calling thread. Returns false if it was cancelled.
bool run_jobs(std::vector<Job> jobs, const PoolSettings& settings,
              const std::function<void(const Job&, const JobEnd&)>& ended);

}  // namespace marrow::cli
