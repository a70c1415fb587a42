// SPDX-License-Identifier: Apache-2.0
#pragma once
// Work in another process: what may crash, hang or take all memory does so there, and is one job's failure here.
// Readers of files, cells of a comparison, checks of conformance and unknown libraries all run in workers.
//
// A worker reads requests and writes reports and answers, one JSON document a line:
//   {"job": 7, "do": "call", ...}             to the worker: what to do, and the job's number
//   {"job": 7, "say": "progress", ...}        from it, any number of times, while it is at the job
//   {"job": 7, "end": ...}                    the answer, or
//   {"job": 7, "failed": "why", ...}          what went wrong, in words
// A line that is something else, or of another job, ends the worker: nothing that it wrote is believed.
#include <sys/types.h>

#include <atomic>
#include <chrono>
#include <filesystem>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

namespace marrow {

struct WorkerSettings {
  std::vector<std::string> command;  ///< program and its arguments
  std::vector<int> shared = {};      ///< open files that the worker gets as descriptors 3, 4, ...
  bool quiet = false;                ///< what it prints on its standard error goes nowhere
  bool has_large_pages =
      false;  ///< its memory comes in large pages, which is quicker where it takes hundreds of megabytes
};

/// What one job may use.
struct WorkerLimits {
  double seconds = 1e9;  ///< as Worker::seconds() counts
  double memory_mb = 1e9;
  double suspended_seconds = 60;  ///< in a row; counts only where `seconds` is set
};

/// How a job ended.
struct WorkerEnd {
  nlohmann::json answer;          ///< what followed "end"
  std::string failed;             ///< why there is no answer; empty where there is one
  bool died = false;              ///< the process ended or was ended; the worker is of no more use
  bool is_late = false;           ///< it took longer than it may
  bool is_out_of_memory = false;  ///< it wanted more memory than it may have
  int signal = 0;                 ///< that ended it
};

/// A process that does one job at a time. It does not outlive the thread that made it. For one thread at a time.
class Worker {
 public:
  using Said = std::function<void(const nlohmann::json&)>;

  /// Throws Error where no process can be started.
  explicit Worker(const WorkerSettings& settings);
  ~Worker();
  Worker(const Worker&) = delete;
  Worker& operator=(const Worker&) = delete;

  /// Gives it a job; the one before must have ended. A worker that is gone shows it at the next take().
  void ask(nlohmann::json request);
  /// Readable when something has come or the process has ended.
  int descriptor() const { return from_; }
  /// Takes what has come, without waiting: `said` gets each report. The end of the job, once it is there.
  std::optional<WorkerEnd> take(const Said& said);
  /// Ends the process where the job is beyond its limits; then that is the job's end. To be called every second or
  /// oftener.
  std::optional<WorkerEnd> check(const WorkerLimits& limits);
  /// Waits for the end of the job, within its limits. Throws Cancelled, and ends the process, when `cancelled` says so.
  WorkerEnd wait(const WorkerLimits& limits, const std::atomic<bool>* cancelled, const Said& said);

  /// Ends the process, whose job has ended; returns when it is gone.
  void close();
  bool is_dead() const { return process_ < 0; }
  pid_t process() const { return process_; }
  /// That the job has had so far. Not counted: while it waits for another's result, and while it or we were suspended.
  double seconds();
  double memory_mb() const;  ///< that it has at present
  /// Where it last reported to be: "node 'edges' (lateral)". Empty where it did not.
  const std::string& at() const { return at_; }

 private:
  WorkerEnd died();
  WorkerEnd ended(const std::string& why);
  std::optional<WorkerEnd> understand(const std::string& line, const Said& said);
  bool is_suspended() const;

  pid_t process_ = -1;
  int to_ = -1, from_ = -1;
  std::uint64_t job_ = 0;
  bool is_busy_ = false, is_waiting_ = false;
  std::string text_, at_;
  std::chrono::steady_clock::time_point looked_;
  double seconds_ = 0, suspended_seconds_ = 0;
};

/// What a worker tells while it is at a job. Safe to use from several threads.
class WorkerReports {
 public:
  virtual ~WorkerReports() = default;
  /// Sends a report: {"say": ..., ...}.
  virtual void say(nlohmann::json report) = 0;
  /// Where it is, for the message if it dies.
  void at(const std::string& place) { say({{"say", "at"}, {"place", place}}); }
  /// Waiting for another process's result begins or ends; that time is not the job's.
  void waiting(bool waits) { say({{"say", waits ? "waiting" : "goes on"}}); }
};

using WorkerTask = std::function<nlohmann::json(const nlohmann::json& request, WorkerReports& reports)>;

/// The worker's side: does what it is asked, until its standard input ends. What an Error says is the job's failure.
/// The standard output is redirected to the standard error first, so that what a library prints cannot pass for an
/// answer.
int serve_worker(const std::map<std::string, WorkerTask>& tasks);

/// The program marrow-worker, which lies beside the framework's library.
std::filesystem::path worker_program();

/// A text of any bytes as JSON: a string, or {"bytes": ...} where it is not UTF-8.
nlohmann::json json_of_bytes(const std::string& text);
/// The way back. Throws Error for anything else.
std::string bytes_of_json(const nlohmann::json& json);

}  // namespace marrow
