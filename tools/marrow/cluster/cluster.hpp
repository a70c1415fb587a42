// SPDX-License-Identifier: Apache-2.0
#pragma once
// Comparisons on a cluster. What is left of one is cut into chunks that tasks do: FOLDER/plans/ID.json.
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "compare/comparison.hpp"

namespace marrow::cli {

/// Work for one task.
struct Chunk {
  std::string name;                  ///< "ID-0007", or "ID-cases-0007"
  std::vector<std::size_t> numbers;  ///< of cells, as in cells_of(), or of cases
};

struct ClusterPlan {
  std::string id;                                   ///< a digest of everything below
  std::filesystem::path file, folder;               ///< the experiment and its comparison's folder, absolute
  std::map<std::string, std::string> texts;         ///< digest of each file that people wrote, by its path
  std::map<std::string, std::string> builds;        ///< build id of each plugin, by the node that it makes
  std::map<std::string, std::string> case_digests;  ///< content of the cases that are folders, by name
  int threads = 1;
  double time_limit_s = 600, memory_limit_mb = 4000;
  bool no_cache = false;
  FileLimits file_limits;
  std::vector<Chunk> cases, cells;  ///< cases to be made first; cells that have no row yet

  std::filesystem::path place() const { return folder / "plans" / (id + ".json"); }
};

/// How cells are grouped.
struct ChunkRule {
  double least_minutes = 10;      ///< of one task, by the estimate
  std::size_t most_tasks = 1000;  ///< with more, each task gets longer instead
};

/// Cuts cells into chunks. The cells of a case share work, so they stay together unless they are much more than a
/// chunk. `numbers` are in rising order.
std::vector<std::vector<std::size_t>> cut_into_chunks(const std::vector<std::size_t>& numbers,
                                                      std::size_t cells_of_a_case, double seconds_of_a_cell,
                                                      const ChunkRule& rule);

/// Makes the plan of the cells that are left, and writes it if there are any. Runs nothing. Throws Error if it cannot
/// be written.
ClusterPlan make_plan(const CompareRequest& request, const Catalogue& catalogue, const compare::Experiment& experiment,
                      const std::filesystem::path& folder, const ChunkRule& rule);

/// Throws Error if the file is no plan.
ClusterPlan read_plan(const std::filesystem::path& file);
/// The newest plan in a comparison's folder. Throws Error if there is none.
ClusterPlan latest_plan(const std::filesystem::path& folder);
/// Throws Error if the experiment, its pipelines, a plugin or a case is not what it was when the plan was made.
void expect_as_planned(const ClusterPlan& plan, const Catalogue& catalogue, const compare::Experiment& experiment);

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

// The files beside a plan by which other programs run its chunks. GNU parallel, Snakemake and Slurm interpret the words
// that they pass on: they call shells, and replace braces or percent signs. So they get no paths, only names made of
// the plan's id. Paths are in scripts for /bin/sh, in single quotes.

/// Names of chunks, one on each line.
void write_list(const std::filesystem::path& file, const std::vector<Chunk>& chunks);

/// Writes plans/ID-chunk.sh, which runs the chunk that is its argument with the settings of this process, and returns
/// its path.
std::filesystem::path write_chunk_script(const ClusterPlan& plan, const ClusterProfile& profile);
/// Writes plans/ID-gather.sh, which makes tables and report from the existing rows, and returns its path. `more`:
/// further words of the command.
std::filesystem::path write_gather_script(const ClusterPlan& plan, const std::vector<std::string>& more = {});

/// Writes a script for GNU parallel, and returns the command that starts it.
std::string emit_parallel(const ClusterPlan& plan);
/// Writes a Snakefile, and returns the command that starts it.
std::string emit_snakemake(const ClusterPlan& plan, const ClusterProfile& profile);

// Slurm: arrays of tasks that do the chunks of a plan, and a job that gathers their rows.

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

// `marrow compare` with --on, --emit, --status, --cancel and --gather.

struct ClusterRequest {
  std::string on;    ///< "slurm", or empty
  std::string emit;  ///< "snakemake" or "parallel", or empty
  std::filesystem::path profile;
  bool wait = false, status = false, cancel = false;
  bool as_json = false;  ///< of the status
  ChunkRule rule;

  bool is_given() const { return !on.empty() || !emit.empty() || status || cancel; }
};

void add_cluster_options(CLI::App* command, CompareRequest& request, ClusterRequest& cluster);

/// Does what the options ask for, and returns the exit code.
int compare_on_cluster(const CompareRequest& asked, const ClusterRequest& cluster, const Catalogue& catalogue,
                       const compare::Experiment& experiment, const std::filesystem::path& folder);

// The files in which the tasks of a cluster leave the rows of their cells: FOLDER/rows/CHUNK.jsonl. While a task runs,
// its file is CHUNK.PROCESS.part, a name that no other process on any host uses. It is renamed when it has all rows.
// Each row holds its own digest, so the rows of a killed task count too.

/// The chunks that have a file: true if it has its final name. The folder is listed, because on a shared folder a file
/// that was absent before may seem to be absent still.
std::map<std::string, bool> chunk_files(const std::filesystem::path& folder);

/// The sentence, without control characters; empty if there is none.
std::string fault_of_chunk(const std::filesystem::path& folder, const std::string& chunk);

/// What tasks left in a folder.
class RowsOfChunks {
 public:
  /// Leaves out lines that are damaged or of another experiment. Rows of failed cells count only if they are of this
  /// plan; `plan` may be empty. If `cells` is not empty, only rows of these cells are read completely: a task reads the
  /// files of all others, and must not spend time on rows that it does not need.
  RowsOfChunks(const std::filesystem::path& folder, const compare::Experiment& experiment, const std::string& plan,
               std::set<std::string> cells = {});

  /// A row of the finished cell. Its key is `key`, but may be of another machine. Of several rows, the one that this
  /// machine made, else the first in the order of their texts. It gets the names of the cell.
  std::optional<compare::CellRow> done(const compare::CellIndex& cell, const std::string& key) const;
  /// Whether a row with the same key as `taken`, or that of another machine, has another result.
  bool contradicts(const compare::CellIndex& cell, const compare::CellRow& taken) const;
  /// A row that says why the cell failed. Of several, the first in the order of their texts.
  std::optional<compare::CellRow> failed(const compare::CellIndex& cell) const;

 private:
  void add_file(const std::filesystem::path& file, bool is_of_plan);
  void add_line(const std::string& line, bool is_of_plan);
  bool is_wanted(const std::string& line) const;
  std::vector<compare::CellRow> rows_of(const compare::CellIndex& cell, const std::string& key) const;

  const compare::Experiment& experiment_;
  std::set<std::string> cells_;
  std::map<std::string, std::vector<compare::CellRow>> done_;  ///< by the name of the cell
  std::map<std::string, compare::CellRow> failed_;
};

}  // namespace marrow::cli
