// SPDX-License-Identifier: Apache-2.0
#pragma once
// Work in another process. If the work crashes, hangs or takes all memory, only one job fails here. Workers read files,
// run the cells of a comparison, run the checks of conformance, and load unknown libraries.
//
// A worker reads requests and writes reports and answers, one JSON document per line:
//   {"job": 7, "do": "call", ...}             to the worker: what to do, and the job's number
//   {"job": 7, "say": "progress", ...}        from the worker: a report, any number of times during the job
//   {"job": 7, "end": ...}                    from the worker: the answer, or
//   {"job": 7, "failed": "why", ...}          what went wrong, in words
// If a worker writes any other line, or a line of another job, it is killed and its job fails.
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

#include "marrow/base/descriptor.hpp"

namespace MARROW_EXPORT marrow {

struct WorkerSettings {
  std::vector<std::string> command;  ///< program and its arguments
  std::vector<int> shared = {};      ///< open files that the worker gets as descriptors 3, 4, ...
  bool quiet = false;                ///< discard what it prints on its standard error
};

/// What one job may use.
struct WorkerLimits {
  double seconds = 1e9;  ///< as counted by Worker::seconds()
  double memory_mb = 1e9;
  double suspended_seconds = 60;  ///< without a break; checked only if `seconds` is set
};

/// How a job ended.
struct WorkerEnd {
  nlohmann::json answer;          ///< the value of "end"
  std::string failed;             ///< why there is no answer; empty if there is one
  bool died = false;              ///< the process ended or was killed; the worker cannot be used any more
  bool is_late = false;           ///< it exceeded its time limit
  bool is_out_of_memory = false;  ///< it exceeded its memory limit, or there was no memory
  int signal = 0;                 ///< the signal that ended it, or 0
};

/// A process that does one job at a time. It is killed when the thread that made it ends. Use a Worker from one thread
/// at a time only.
class Worker {
 public:
  using Said = std::function<void(const nlohmann::json&)>;

  /// Throws Error if no process can be started.
  explicit Worker(const WorkerSettings& settings);
  ~Worker();
  Worker(const Worker&) = delete;
  Worker& operator=(const Worker&) = delete;

  /// Gives it a job. The job before must have ended. If the process has ended, the next take() reports that.
  void ask(nlohmann::json request);
  /// This descriptor becomes readable when a line has come or the process has ended.
  int descriptor() const { return from_; }
  /// Reads what has come, without waiting, and passes each report to `said`. Returns the end of the job once it has
  /// come.
  std::optional<WorkerEnd> take(const Said& said);
  /// Kills the process if the job exceeds its limits, and then returns the end of the job. Call it at least once a
  /// second.
  std::optional<WorkerEnd> check(const WorkerLimits& limits);
  /// Waits for the end of the job and checks its limits. If `cancelled` becomes true, kills the process and throws
  /// Cancelled.
  WorkerEnd wait(const WorkerLimits& limits, const std::atomic<bool>* cancelled, const Said& said);

  /// Kills the process and returns when it is gone. Call it when the job has ended.
  void close();
  bool is_dead() const { return process_ < 0; }
  /// Whether the process can no longer answer although take() has not reported its end: its main thread has ended, but
  /// other threads, which are still ending, hold its output open.
  bool is_ending() const;
  pid_t process() const { return process_; }
  /// Time that the job has taken so far. Time in which it waits for another process's result, or in which the worker or
  /// this process is suspended, does not count.
  double seconds();
  /// Resident memory of the process and of all that it started, at present. What they share counts once.
  double memory_mb() const;
  /// The place that it last reported: "node 'edges' (lateral)". Empty if it reported none.
  const std::string& at() const { return at_; }

 private:
  WorkerEnd died();
  WorkerEnd ended(const std::string& why);
  std::optional<WorkerEnd> understand(const std::string& line, const Said& said);
  char state() const;
  bool is_suspended() const;

  pid_t process_ = -1;
  Descriptor to_, from_;
  std::uint64_t job_ = 0;
  bool is_busy_ = false, is_waiting_ = false;
  std::string text_, at_;
  std::chrono::steady_clock::time_point looked_;
  double seconds_ = 0, suspended_seconds_ = 0;
};

/// Sends reports from the worker during a job. Safe to use from several threads.
class WorkerReports {
 public:
  virtual ~WorkerReports() = default;
  /// Sends a report: {"say": ..., ...}.
  virtual void say(nlohmann::json report) = 0;
  /// Reports where the job is, for the message if the process dies.
  void at(const std::string& place) { say({{"say", "at"}, {"place", place}}); }
  /// Reports that the job begins or ends to wait for another process's result. This time does not count.
  void waiting(bool waits) { say({{"say", waits ? "waiting" : "goes on"}}); }
};

using WorkerTask = std::function<nlohmann::json(const nlohmann::json& request, WorkerReports& reports)>;

/// The worker's side: does the tasks that are requested until its standard input ends. If a task throws, the job fails
/// with the text of the exception. Before that, the standard output is redirected to the standard error, and the
/// standard input to /dev/null, so that what a library prints is not taken for an answer, and no library and no process
/// that it starts reads a request.
int serve_worker(const std::map<std::string, WorkerTask>& tasks);

/// A sentence for a process that got SIGKILL. No fault of a program sends that signal, so its work is not to blame.
std::string killed_from_outside(const std::string& process);

/// The program marrow-worker, in the folder `marrow` next to the framework's library.
std::filesystem::path worker_program();

/// A text of any bytes as JSON: a string, or {"bytes": ...} if it is not UTF-8.
nlohmann::json json_of_bytes(const std::string& text);
/// The inverse of json_of_bytes(). Throws Error for any other JSON.
std::string bytes_of_json(const nlohmann::json& json);

}  // namespace marrow
