// SPDX-License-Identifier: Apache-2.0
#pragma once
// The cells of a comparison as jobs for worker processes, and what counts of rows that were made before.
#include <atomic>
#include <chrono>
#include <cstddef>
#include <filesystem>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "cluster/cluster.hpp"

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

/// Shows the progress of work with many parts on the standard error: one line that changes on a terminal, otherwise a
/// line at the beginning, every five seconds and at the end.
class Progress {
 public:
  /// `what` names the parts in the first line: "0 of 240 cells".
  Progress(std::size_t all, const std::string& what, bool quiet);
  /// One more part is done, `what`.
  void add(const std::string& what) { done(number_ + 1, what); }
  /// `number` parts are done; `what` is the last of them.
  void done(std::size_t number, const std::string& what);

 private:
  std::size_t all_, number_ = 0;
  bool quiet_, is_terminal_;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now(), last_ = start_;
};

/// The settings of workers that run cells into `folder`.
PoolSettings pool_of(const CompareRequest& request, const std::filesystem::path& folder, int threads);

/// The cells of an experiment, numbered as in cells_of(), with their keys. Not thread-safe.
class CellJobs {
 public:
  CellJobs(const compare::Experiment& experiment, compare::CellRunner& runner);

  std::size_t count() const { return cells_.size(); }
  const compare::CellIndex& cell(std::size_t number) const { return cells_[number]; }
  std::size_t number_of(const compare::CellIndex& cell) const;
  /// The present key of everything that the cell depends on. It is kept for job_of() and row_of().
  const std::string& take_key(std::size_t number);

  /// `what` is "cell", "time" or "draw". Call take_key() before.
  Job job_of(const char* what, std::size_t number, std::string group) const;
  /// Jobs that make the simulated ones of these cases.
  std::vector<Job> cases_of(const std::vector<std::size_t>& case_numbers) const;
  /// The row from a worker's answer. The answer counts only if it is about the requested cell.
  compare::CellRow row_of(const Job& job, const JobEnd& end) const;
  /// Why a case cannot be made, from the end of its job. Empty if it was made.
  std::string fault_of_case(const Job& job, const JobEnd& end) const;

 private:
  const compare::Experiment& experiment_;
  compare::CellRunner& runner_;
  std::vector<compare::CellIndex> cells_;
  std::vector<std::string> keys_;
};

/// The rows of a comparison that were made before, here or by tasks of a cluster. A row counts only if its key is that
/// of the cell's present dependencies, and if nobody changed it.
class KnownRows {
 public:
  /// `plan` as for RowsOfChunks.
  KnownRows(const compare::Experiment& experiment, const compare::CellRunner& runner,
            const std::filesystem::path& folder, const std::string& plan)
      : runner_(runner), chunks_(folder, experiment, plan) {}

  /// The row of a cell that is done. If a task made it, what an earlier run left of the cell in this folder is removed,
  /// because its outputs are not those of the row.
  std::optional<compare::CellRow> done(const compare::CellIndex& cell, const std::string& key);
  /// A task's row of a cell that is not done, which says why; nothing if no task left one. What an earlier run left of
  /// the cell is removed.
  std::optional<compare::CellRow> failed(const compare::CellIndex& cell) const;
  /// Says which rows were not believed, and which contradict each other.
  void say_doubts() const;

 private:
  /// What one note says: the number of cells, and the first one.
  struct Remark {
    std::size_t cells = 0;
    std::string first;
    void add(const std::string& what);
  };

  const compare::CellRunner& runner_;
  RowsOfChunks chunks_;
  Remark changed_, contradicting_;
};

/// Checks that nothing changed while a comparison ran. Each process of a comparison reads the files itself. If a file
/// changes meanwhile, not all processes use the same content.
class Unchanged {
 public:
  enum class Cases { all, held_out };
  /// Reads the files that define the comparison. If the experiment tunes options, it may have all of its cases, or only
  /// those that are held out.
  explicit Unchanged(const compare::Experiment& experiment, Cases cases = Cases::held_out);
  /// Throws Error if something changed, and names it.
  void check(const compare::Dependencies& dependencies) const;

 private:
  const compare::Experiment& experiment_;
  Cases cases_;
  std::map<std::filesystem::path, std::string> texts_;
};

}  // namespace marrow::cli
